"""Actions, cases and the loop on tiny tables, with a stub in place of a classifier."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.alignment.icp import ICPSettings
from gpca.alignment.pose_error import CORRECT
from gpca.alignment.rigid import inverse, rotation_angle_rad
from gpca.attribution.scores import Attribution
from gpca.errors import InputError
from gpca.frames.camera import Camera, DepthNoise
from gpca.frames.initial_pose import InitialPoseSettings
from gpca.frames.situations import Shelf, Situations, SituationSettings
from gpca.pairs.perturbation import CONCEPTS
from gpca.recovery import actions
from gpca.recovery.actions import ACTIONS, action_of, best_start
from gpca.recovery.cases import RobotIn, register_after, register_first, register_held
from gpca.recovery.loop import Episode, Loop, LoopSettings, as_shares, find_failures, register_situations
from gpca.recovery.policies import POLICIES
from gpca.recovery.policy import QUEUE, RecoveryPolicy, Thresholds

from ..documents import block
from ..frames.tiny import scene_settings, surfaces

LOOP = LoopSettings(failures=1, tries=12, budget=3, cloud_points=400)
ICP = ICPSettings()


@pytest.fixture(scope="module")
def situations():
    shelf = Shelf(surfaces(), "tiny", 1024, InitialPoseSettings(tries=2))
    scenes = scene_settings(noise=DepthNoise(), objects=(3, 3), count=2, camera=Camera(160, 120, 285))
    settings = SituationSettings(scenes=scenes, noise_scale=(5.0, 8.0), hidden=(0.5, 0.95))
    return {part: Situations(shelf, settings, ("tiny", 1, part)) for part in ("train", "test", "failures")}


@pytest.fixture(scope="module")
def start(situations):
    """A bad initial pose of the bracket, which no rotation leaves as it is, and the first registration from it."""
    for number in range(60):
        disturbed, _ = situations["failures"].draw("pose", "pose", number)
        outcome = register_first(disturbed, LOOP.cloud_points, ICP)
        if outcome is not None and outcome.error > CORRECT:
            return disturbed, outcome
    raise AssertionError("no failure")


def test_a_registration_is_that_of_its_row(start):
    situation, outcome = start
    d = situation.diameter_m
    T_target_source = outcome.record["T_target_source_icp"]
    held = outcome.holding
    assert held.T_world_object == pytest.approx(held.T_world_object_init @ inverse(T_target_source))
    T_error = inverse(outcome.record["T_target_source_true"]) @ T_target_source
    if not situation.shelf.symmetric[situation.model]:
        assert outcome.error > 0.5 * np.linalg.norm(T_error[:3, 3]) / d - 0.5
    right = replace(held, T_world_object_init=situation.T_world_object)
    assert register_held(situation, right, LOOP.cloud_points, ICP).error < 0.05


def test_a_broader_search_finds_what_explains_the_shots(start):
    situation, outcome = start
    found = ACTIONS["reinitialise"](outcome.holding, RobotIn(situation), np.random.default_rng(0), starts=48)
    assert register_held(situation, found, LOOP.cloud_points, ICP).error < outcome.error
    assert found.shots is outcome.holding.shots


def test_a_new_view_is_fused_with_the_old_one_and_shows_more(start):
    situation, outcome = start
    d = situation.diameter_m
    result = register_after(situation, outcome, ACTIONS["new_view"], ("new_view",), 4000, ICP)
    first_shot, new = result.holding.shots
    assert first_shot is outcome.holding.shots[0]
    turned = rotation_angle_rad(inverse(first_shot.T_world_camera) @ new.T_world_camera)
    assert np.rad2deg(turned) > 30
    both = len(first_shot.object_points_m(d)) + len(new.object_points_m(d))
    assert len(result.record["cloud"]) == min(4000, both)


def test_denoising_takes_more_frames_each_time_and_keeps_doing_so(start):
    situation, outcome = start
    once = register_after(situation, outcome, ACTIONS["denoise"], ("denoise",), LOOP.cloud_points, ICP)
    twice = register_after(situation, once, ACTIONS["denoise"], ("denoise", "denoise"), LOOP.cloud_points, ICP)
    assert (once.holding.frames, twice.holding.frames) == (10, 20)
    assert once.holding.filtered
    looked = register_after(situation, once, ACTIONS["new_view"], ("denoise", "new_view"), LOOP.cloud_points, ICP)
    assert looked.holding.frames == 10


def test_the_action_of_the_documentation_sees_the_object_from_closer(start):
    situation, outcome = start
    added = dict(vars(actions)) | {"ACTIONS": dict(ACTIONS)}
    exec(block("gpca/recovery/actions.py"), added)
    result = register_after(situation, outcome, added["ACTIONS"]["closer"], ("closer",), LOOP.cloud_points, ICP)
    away, near = result.holding.shots
    assert away is outcome.holding.shots[0]
    assert near.mask.sum() > 1.5 * away.mask.sum()


def test_the_pose_that_explains_the_shots_is_started_from(start):
    situation, outcome = start
    robot, true = RobotIn(situation), situation.T_world_object
    assert (best_start(outcome.holding, robot, [None, true]).T_world_object_init == true).all()


def test_an_action_gives_the_same_again(start):
    situation, outcome = start
    given = (situation, outcome, ACTIONS["new_view"], ("new_view",), LOOP.cloud_points, ICP)
    a, b = (register_after(*given) for _ in range(2))
    assert (a.record["cloud"] == b.record["cloud"]).all()
    assert a.error == b.error


def stub(concept):
    """An explainer that names the same concept whatever it sees, and counts what it is asked."""

    def explain(registrations):
        assert (registrations.concept == "").all()  # no truth
        assert np.isnan(registrations.T_target_source_true).all()
        explain.asked += registrations.sample.tolist()
        scores = np.tile(np.where(np.array(CONCEPTS) == concept, 0.8, 0.1), (len(registrations), 1))
        said = Attribution.of_scores(CONCEPTS, scores, seconds=0.5)
        return replace(said, bald_N=np.full(len(registrations), 0.1))

    explain.asked = []
    return explain


@pytest.fixture
def loop(start):
    episode = Episode(0, *start, tries=5)
    actions = {name: action_of(name, {}) for name in ACTIONS}

    def run(policies, concept="overlap", **thresholds):
        explain = stub(concept)
        given = {"gpca": explain, "softmax_head": stub(concept)}
        policy = RecoveryPolicy(Thresholds(**{"uncertain": 0.2, "dominant": 0.4} | thresholds))
        rows, seconds = Loop([episode], actions, given, policy, LOOP, ("tiny", 0)).run(policies)
        return rows, seconds, explain

    return run


def test_policies_share_what_an_action_gives_and_end_with_success_or_the_budget(loop):
    rows, seconds, _ = loop(["gpca", "softmax_head", "always_new_view", "oracle"])
    assert (rows[["episode", "policy", "step"]] == seconds[["episode", "policy", "step"]]).all(axis=None)
    firsts = rows[rows["step"] == 1].set_index("policy")
    for same in ("softmax_head", "always_new_view"):
        assert firsts.loc[same, "error_after"] == firsts.loc["gpca", "error_after"]
    assert firsts.loc["oracle", "action"] == "reinitialise"
    for _, of_policy in rows.groupby("policy"):
        assert not of_policy["recovered"].iloc[:-1].any()
        assert of_policy["recovered"].iloc[-1] or len(of_policy) == LOOP.budget
        assert (of_policy["error_before"].iloc[1:].to_numpy() == of_policy["error_after"].iloc[:-1].to_numpy()).all()
    assert (rows["recovered"] == (rows["error_after"] <= CORRECT)).all()
    assert (seconds.loc[rows["policy"] == "gpca", "explanation_seconds"] >= 0.5).all()


def test_an_explainer_sees_each_registration_once(loop):
    _, _, explain = loop(["gpca", "gpca_acting"])
    assert len(explain.asked) == len(set(explain.asked))


def test_a_queued_case_ends_there(loop):
    rows, *_ = loop(["gpca", "gpca_acting"], uncertain=0.05)
    queued = rows[rows["policy"] == "gpca"]
    assert queued["action"].tolist() == [QUEUE]
    assert not queued["recovered"].any()
    assert (rows.loc[rows["policy"] == "gpca_acting", "action"] != QUEUE).all()


def test_a_policy_does_not_insist_on_what_did_not_help(loop):
    rows, *_ = loop(["gpca_acting"])
    assert rows["action"].is_unique  # the stub's scores never fall


def test_failures_have_their_cause_and_are_bounded(situations):
    episodes = find_failures(situations["failures"], LoopSettings(failures=1, tries=8, cloud_points=400))
    for episode in episodes:
        assert episode.outcomes[()].error > CORRECT
        assert episode.tries <= 8
    causes = [episode.situation.cause for episode in episodes]
    assert len(set(causes)) == len(causes)


def test_no_failure_at_all_is_one_line(situations, monkeypatch):
    monkeypatch.setattr("gpca.recovery.loop.register_first", lambda *given: None)
    with pytest.raises(InputError, match=r"no registration failed \(2 of noise, 2 of pose, 2 of overlap\)"):
        find_failures(situations["failures"], LoopSettings(tries=2))


def test_the_classifier_learns_from_all_causes(situations):
    registrations, failed = register_situations(situations, 6, 3, LOOP)
    assert registrations.concept.tolist() == list(CONCEPTS) * 3
    assert registrations.split.tolist() == ["train"] * 6 + ["test"] * 3
    assert failed.shape == (9,)


def test_signed_scores_become_shares():
    shares = as_shares(np.array([[0.2, 0.3, 0.5]]))
    assert shares.tolist() == [[0.2, 0.3, 0.5]]
    signed = as_shares(np.array([[-1.0, 0.0, 2.0]]))
    assert signed.sum() == pytest.approx(1)
    assert signed[0].argmax() == 2


@pytest.mark.parametrize(
    ("name", "given", "fault"),
    [("pray", {}, "unknown; known are reinitialise"), ("denoise", {"framse": 3}, "unexpected keyword argument")],
)
def test_unknown_actions_and_settings_are_refused(name, given, fault):
    with pytest.raises(InputError, match=fault):
        action_of(name, given)


def test_every_explainer_of_a_policy_exists():
    from baselines.registry import explainer_entry

    reads = {explainer_entry(entry.explainer).reads for entry in POLICIES.values() if entry.explainer}
    assert reads == {"embeddings", "uncertainty/removal"}
