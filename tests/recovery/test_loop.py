"""The loop on a tiny table, with a stub in place of a classifier, and its re-enactments."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gpca.causes.policy import NOTHING, RecoveryPolicy, Thresholds
from gpca.causes.settings import OBSERVED, CauseSettings
from gpca.classifier.scores import Attribution
from gpca.errors import InputError
from gpca.pairs.perturbation import CONCEPTS
from gpca.recovery.actions import ACTIONS, action_of
from gpca.recovery.episodes import Episode
from gpca.recovery.loop import Loop, Reenactor, calibrated_alarm
from gpca.recovery.policies import POLICIES, Means
from gpca.reenactment.settings import ReenactmentSettings
from tests.failures import LOOP


def blanked(episode):
    """The same episode without anything that only the truth tells."""
    situation, start = episode.situation, episode.outcomes[()]
    nowhere = np.full((4, 4), np.nan)
    standing = tuple(replace(object_, T_world_object=nowhere) for object_ in situation.standing)
    situation = replace(situation, standing=standing, T_object_estimated=nowhere, cause="")
    record = start.record | {"T_target_source_true": nowhere, "concept": ""}
    return Episode(1, situation, replace(start, record=record, error=np.nan), LOOP.success)


def test_no_truth_is_read_and_a_registration_is_re_enacted_once(start):
    episode, once = Episode(0, *start, LOOP.success), Reenactor(ReenactmentSettings(), CauseSettings(moved=OBSERVED))
    seen, blind = (once.reenact(e, ()) for e in (episode, blanked(episode)))
    assert seen.belief.failure == blind.belief.failure
    assert np.array_equal(seen.phi_3, blind.phi_3)
    assert once.reenact(episode, ()) is seen and seen.belief is once.believe(episode, ())


class Believing:
    """Takes every episode for failed with the probability that it has by itself."""

    def believe(self, episode, _actions):
        return SimpleNamespace(failure=episode.failure)


def test_the_alarm_is_set_on_the_good_ones():
    good = [SimpleNamespace(failed=False, failure=n / 100) for n in range(1, 20)]
    failed = [SimpleNamespace(failed=True, failure=0.9)] * 30
    assert calibrated_alarm([*good, *failed], Believing(), 0.05) == 0.19
    assert calibrated_alarm([*good, *failed], Believing(), 0.5) == 0.10
    with pytest.raises(InputError, match="has no good registration by which the alarm"):
        calibrated_alarm(failed, Believing(), 0.05)


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


class Reenacting:
    """Re-enacts nothing: a failure by its start it is, whatever was registered."""

    def reenact(self, episode, actions):
        believed = SimpleNamespace(failure=0.9)
        return SimpleNamespace(phi_3=np.array([0.1, 0.3, 0.2]), belief=believed, seconds=0.5)


@pytest.fixture
def loop(start):
    episode = Episode(0, *start, LOOP.success, tries=5)
    actions = {name: action_of(name, {}) for name in ACTIONS}

    def run(policies, concept="overlap", others=(), **thresholds):
        explain = stub(concept)
        given = {"gpca": explain, "softmax_head": stub(concept)}
        policy = RecoveryPolicy(Thresholds(**{"uncertain": 0.2, "dominant": 0.4} | thresholds))
        means = Means(policy, tuple(actions), alarm=0.5)
        rows, seconds = Loop([episode, *others], actions, given, means, LOOP, ("tiny", 0), Reenacting()).run(policies)
        return rows, seconds, explain

    return run


def test_policies_share_what_an_action_gives_and_end_with_success_or_the_budget(loop):
    rows, seconds, _ = loop(["gpca", "softmax_head", "always_new_view", "oracle"])
    assert (rows[["episode", "policy", "step"]] == seconds[["episode", "policy", "step"]]).all(axis=None)
    firsts = rows[rows["step"] == 1].set_index("policy")
    for same in ("softmax_head", "always_new_view"):
        assert firsts.loc[same, "error_after"] == firsts.loc["gpca", "error_after"]
    assert firsts.loc["oracle", "action"] == "reinitialize"
    for _, of_policy in rows.groupby("policy"):
        assert not of_policy["recovered"].iloc[:-1].any()
        assert of_policy["recovered"].iloc[-1] or len(of_policy) == LOOP.budget
        assert (of_policy["error_before"].iloc[1:].to_numpy() == of_policy["error_after"].iloc[:-1].to_numpy()).all()
    assert (rows["recovered"] == (rows["error_after"] < LOOP.success)).all()
    assert (seconds.loc[rows["policy"] == "gpca", "explanation_seconds"] >= 0.5).all()


def test_an_explainer_sees_each_registration_once_and_no_policy_insists_on_what_did_not_help(loop):
    rows, _, explain = loop(["gpca", "gpca_acting"])
    assert len(explain.asked) == len(set(explain.asked))
    assert rows.loc[rows["policy"] == "gpca_acting", "action"].is_unique  # the stub's scores never fall


def test_about_what_did_not_fail_a_policy_only_decides(loop, start):
    situation, outcome = start
    fine = Episode(1, situation, replace(outcome, error=0.01), LOOP.success)
    rows, *_ = loop(["gpca_acting", "oracle"], others=[fine])
    assert rows[rows["episode"] == 1].set_index("policy")["action"].to_dict() == {
        "gpca_acting": "new_view",
        "oracle": NOTHING,
    }
    assert not rows.loc[rows["episode"] == 1, ["failed", "recovered"]].any(axis=None)
    assert list(fine.outcomes) == [()]


def test_policies_that_re_enact_are_given_it_and_its_seconds_count_for_each(loop):
    rows, seconds, _ = loop(["reenact", "reenact_gated"])
    firsts = rows[rows["step"] == 1]
    assert (firsts["action"] == "reinitialize").all()
    assert (firsts["concept"] == "pose").all()
    assert (seconds["explanation_seconds"] >= 0.5).all()


def test_every_explainer_of_a_policy_exists():
    from gpca.explainers.registry import explainer_entry

    reads = {explainer_entry(entry.explainer).reads for entry in POLICIES.values() if entry.explainer}
    assert reads == {"embeddings", "uncertainty/removal"}
