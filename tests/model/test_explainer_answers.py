"""What an explanation says: as text and JSON, its warnings, and what is to be done."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from gpca import Explainer
from gpca.causes.policy import NOTHING, QUEUE, RecoveryPolicy, Thresholds
from gpca.explainers.pair_classifier import PairClassifier
from gpca.model.diagnosis import ADVICE
from gpca.rigid import exp, inverse, transform
from gpca.uncertainty.settings import UncertaintySettings


def test_an_explanation_is_json_and_text(explainer, pair):
    explanation = explainer.explain(*pair, uncertainty=UncertaintySettings(starts=13))
    plain = json.loads(json.dumps(explanation.as_dict()))
    assert plain["scores"] == explanation.scores
    assert np.array(plain["T_target_source"]).shape == (4, 4)
    assert plain["spread"]["starts"] == 13
    brief, text = explanation.text(), explanation.text(verbose=True)
    for word in (explanation.diagnosis.state, ADVICE[explanation.action], "over 13 starts"):
        assert word in brief
    for word in ("variance", "BALD", "ms        preparation "):
        assert word not in brief and word in text
    assert all(len(line) <= 100 for line in text.splitlines())
    assert plain["diagnosis"]["state"] == explanation.diagnosis.state
    stages = ["preparation", "icp", "diagnosis", "embedding", "attribution", "familiarity", "uncertainty"]
    assert list(plain["seconds"]) == [*stages, "total"]
    assert plain["seconds"]["total"] >= sum(plain["seconds"][stage] for stage in stages)


def test_the_inverse_of_the_initial_pose_is_found_out(explainer, pair):
    source, target = pair
    T_source_seen = exp(np.array([[1.0, -2.0, 0.5, 0.03, 0.04, -0.1]]))[0]
    seen = transform(inverse(T_source_seen), source)
    doubt = "the inverse of the initial pose fits far better: is it T_source_target?"
    assert doubt in explainer.explain(seen, target, inverse(T_source_seen)).warnings
    assert doubt not in explainer.explain(seen, target, T_source_seen).warnings


def test_what_is_unlike_the_training_is_said_in_text_and_in_json(model, pair):
    source, target = pair
    said = Explainer(model, device="cpu").explain(3 * source, target)
    [line] = [line for line in said.warnings if "are both in the same unit and scale?" in line]
    assert f"warning {line}" in " ".join(said.text().split())
    assert said.as_dict()["warnings"] == list(said.warnings)


def test_a_pair_far_from_all_that_the_diagnosis_learnt_is_said_to_be(explainer, pair, monkeypatch):
    for unlike, words in ((1.7, ["1.7"]), (0.9, [])):
        monkeypatch.setattr(PairClassifier, "unlikeness", lambda self, inputs, unlike=unlike: np.array([unlike]))
        said = explainer.explain(*pair)
        assert [line.split()[3] for line in said.warnings if "that the diagnosis was trained on" in line] == words
        assert said.diagnosis.unlikeness == unlike


def with_threshold(model, threshold):
    levels = tuple(replace(level, threshold=threshold) for level in model.diagnoser.levels)
    diagnoser = replace(model.diagnoser, levels=levels, start_threshold=2.0)
    return Explainer(replace(model, diagnoser=diagnoser), device="cpu")


def test_nothing_is_done_about_what_is_fine(model, pair):
    said = with_threshold(model, 2.0).explain(*pair)
    assert (said.diagnosis.state, said.diagnosis.named) == ("nominal", ())
    doubtful = said.diagnosis.doubtful
    nothing = "no failure is shown" if doubtful else "nothing is wrong"
    assert (said.action, said.reason) == (NOTHING, nothing)
    assert f"state     {'probably ' * doubtful}nominal: {nothing}" in said.text()
    assert f"action    none\nreason    {nothing}\n" in said.text()


def test_what_failed_is_treated_by_its_causes(model, pair):
    said = with_threshold(model, 0.0).explain(*pair)
    found = said.diagnosis
    assert found.state == "failed"
    decision = model.policy.decide(np.array(list(found.causes.values())), found.bald)
    assert (said.action, said.reason) == (decision.action, decision.reason)
    assert f"state     {'probably ' * found.doubtful}failed: {' and '.join(found.named)}" in said.text()
    in_mm = with_threshold(model, 0.0).explain(*(1e3 * cloud for cloud in pair), unit="mm")
    assert in_mm.diagnosis.expected_error == pytest.approx(1e3 * found.expected_error, rel=0.1)


def test_a_reenactment_finds_the_pose_that_a_registration_missed(explainer):
    source, target = ell(400, 0), ell(500, 1)
    T_start = exp(np.array([[0, 0, np.pi / 2, 0, 0, 0]]))[0]  # from here ICP does not come back
    said = explainer.explain(transform(T_start, source), target)
    best = said.diagnosis.reenacted.poses[0]
    assert not best.registered
    error = transform(best.T_target_source, transform(T_start, source)) - source
    assert np.sqrt(np.square(error).sum(axis=1)).mean() < 0.005
    assert re.search(rf"pose 1 probability \S+: {re.escape(best.words('m'))} ", " ".join(said.text().split()))
    in_mm = explainer.explain(1e3 * transform(T_start, source), 1e3 * target, unit="mm").diagnosis.reenacted
    assert in_mm.error == pytest.approx(1e3 * said.diagnosis.reenacted.error, rel=1e-6)
    assert in_mm.poses[0].shift == pytest.approx(1e3 * best.shift, rel=1e-6)


def test_a_turn_about_the_axis_of_a_symmetric_object_is_no_other_pose(explainer):
    random = np.random.default_rng(2)
    turn, height = random.uniform(0, 2 * np.pi, (2, 600)), random.uniform(-0.06, 0.06, (2, 600))
    source, target = np.stack([0.03 * np.cos(turn), 0.03 * np.sin(turn), height], axis=2)
    T_start = exp(np.array([[0, 0, 1.0, 0, 0, 0]]))[0]
    poses = explainer.explain(transform(T_start, source), target).diagnosis.reenacted.poses
    assert poses[0].registered
    assert poses[0].turn_deg < 10
    assert sum(pose.registered for pose in poses) == 1


def test_clouds_of_which_no_surface_can_be_made_are_explained_all_the_same(explainer):
    cloud = ell(64, 3)
    for target in (np.repeat(cloud, 2, axis=0), cloud * np.array([1, 1, 0.0]), np.repeat(cloud, 20, axis=0)):
        said = explainer.explain(cloud, target).diagnosis
        assert np.isfinite([said.result, said.start, said.reenacted.error, *said.reenacted.effects.values()]).all()


def test_a_fast_explanation_promises_nothing_and_says_so(explainer, pair):
    said = explainer.explain(*pair, fast=True)
    assert said.as_dict()["diagnosis"]["guarantee"] is None
    assert "fast: at most 384 points and 2 poses were re-enacted, and nothing is promised" in said.notes
    assert "guarantee none: " in said.text()
    [again] = explainer.explain_many([pair], fast=True)
    assert json.dumps(again.as_dict()["diagnosis"]) == json.dumps(said.as_dict()["diagnosis"])


def ell(n, seed):
    """Points on two bars of unlike lengths that form an L of 10 cm."""
    random = np.random.default_rng(seed)
    long = random.random(n) < 0.6
    sizes = np.where(long[:, None], (0.1, 0.03, 0.02), (0.03, 0.06, 0.02))
    points = random.random((n, 3)) * sizes
    side = random.integers(3, size=n)
    points[np.arange(n), side] = np.where(random.random(n) < 0.5, 0, sizes[np.arange(n), side])
    return points + np.where(long[:, None], 0.0, (0.0, 0.03, 0.0))


@pytest.mark.parametrize("thresholds", [Thresholds(uncertain=0.0), Thresholds(dominant=0.999)])
def test_a_policy_of_ones_own_queues_what_it_finds_uncertain(model, pair, thresholds):
    judged = replace(with_threshold(model, 0.0).model, policy=RecoveryPolicy(thresholds))
    diagnoser = replace(judged.diagnoser, start_threshold=0.0)  # of a bad start, more is to be learned
    said = Explainer(replace(judged, diagnoser=diagnoser), device="cpu").explain(*pair)
    assert said.action == QUEUE
    assert ADVICE[QUEUE] in said.text()
