from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import KDTree

from baselines.untrained import ThresholdRule
from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.pose_error import PoseErrors, pose_error
from gpca.causes.candidate import Counterfactuals, Registrar, Unmeasurable, draw_applied, draw_candidate, redrawn
from gpca.causes.dataset import labels_of
from gpca.causes.drawing import draw_causes
from gpca.causes.settings import CauseSettings, CauseSeverities, Small
from gpca.config.layers import with_defaults
from gpca.pairs.perturbation import CONCEPTS, NOISE, OVERLAP, POSE
from gpca.rigid import exp, inverse, rotation_angle_rad
from gpca.uncertainty.spread import divergence

SETTINGS = CauseSettings(severities=CauseSeverities(outliers=(0.1, 0.2)))


@pytest.fixture(scope="module")
def candidates(subjects):
    return [
        draw_candidate(subjects[k % 4].surface, np.ones(3, bool), SETTINGS, np.random.default_rng(k)) for k in range(40)
    ]


def test_counts_and_severities_are_within_their_ranges_and_small_of_what_is_not_applied(candidates, subjects):
    for candidate in candidates:
        severity = candidate.severity
        for count in (len(candidate.model), len(candidate.kept)):
            assert 128 <= count <= 1024
        assert 0.01 <= severity["noise"] <= 0.08
        assert 0.1 <= severity["outliers"] <= 0.2
        assert rotation_angle_rad(candidate.T_init) == pytest.approx(severity["rotation_rad"], abs=1e-6)
        assert np.deg2rad(10) <= severity["rotation_rad"] <= np.deg2rad(90)
        assert np.linalg.norm(candidate.T_init[:3, 3]) == pytest.approx(severity["translation"])
        assert len(candidate.kept) == round(len(candidate.clean) * (1 - severity["crop"]))
        assert 0 < rotation_angle_rad(candidate.T_near) <= np.deg2rad(5)
        assert 0 < np.linalg.norm(candidate.T_near[:3, 3]) <= 0.03
        assert 0.95 <= len(candidate.seen) / len(candidate.clean) <= 1
        assert set(candidate.kept) < set(candidate.seen)  # the same side is missing
        assert np.array_equal(candidate.start((0, 2)), candidate.T_near)
        assert np.array_equal(candidate.start((1,)), candidate.T_init)
    assert len({len(candidate.model) - len(candidate.kept) for candidate in candidates}) > 30  # drawn apart
    for k in range(20):
        applied = np.array([False, True, False])
        severity = draw_candidate(subjects[0].surface, applied, SETTINGS, np.random.default_rng(k)).severity
        assert severity["rotation_rad"] >= np.deg2rad(10)
        assert (severity["noise"] <= 0.003, severity["crop"] <= 0.05, severity["outliers"]) == (True, True, 0)


def test_the_number_of_observed_points_tells_nothing_of_what_is_missing(subjects):
    drawn = [
        draw_candidate(subjects[0].surface, np.array([False, False, hidden]), SETTINGS, np.random.default_rng(k))
        for k in range(20)
        for hidden in (False, True)
    ]
    counts = [len(candidate.observed(tuple(np.flatnonzero(candidate.applied)))) for candidate in drawn]
    assert np.abs(np.subtract(counts[::2], counts[1::2])).max() <= 1  # the share is rounded twice
    assert all(128 <= count <= 1024 for count in counts)


def test_a_clean_surface_is_nearly_where_it_is_and_without_anything_small_exactly(subjects):
    surface = subjects[0].surface
    candidate = draw_candidate(surface, np.zeros(3, bool), SETTINGS, np.random.default_rng(3))
    assert 0 < KDTree(surface).query(candidate.clean)[0].max() < 5 * 0.003
    assert candidate.severity["outliers"] == 0
    none = replace(SETTINGS, small=Small(0, 0, 0, 0))
    candidate = draw_candidate(surface, np.zeros(3, bool), none, np.random.default_rng(3))
    assert np.array_equal(candidate.start(()), np.eye(4))
    assert len(candidate.observed(())) == len(candidate.clean)
    assert not KDTree(surface).query(candidate.clean)[0].any()


def test_a_clean_pair_drawn_again_is_as_large_and_starts_where_it_did(subjects):
    random = np.random.default_rng(3)
    first = draw_candidate(subjects[0].surface, np.zeros(3, bool), SETTINGS, random)
    second = redrawn(first, subjects[0].surface, random)
    assert [len(first.model), len(first.observed(()))] == [len(second.model), len(second.observed(()))]
    assert np.array_equal(first.start(()), second.start(()))
    assert not np.isin(second.model, first.model).all()


def test_each_cause_changes_what_it_should_and_nothing_else(candidates):
    candidate = candidates[0]
    clean, noisy, cropped = (candidate.observed(causes) for causes in ((), (0,), (2,)))
    assert np.array_equal(candidate.observed((1,)), clean)  # a pose error changes no point
    assert np.array_equal(clean, candidate.clean[candidate.seen])
    assert np.array_equal(noisy, candidate.noisy[candidate.seen])
    assert np.array_equal(cropped, candidate.clean[candidate.kept])
    assert np.array_equal(candidate.observed((0, 2)), candidate.noisy[candidate.kept])


def test_noise_is_as_strong_as_it_says_outliers_are_few_and_one_side_is_cut_off(candidates):
    for candidate in candidates:
        assert not set(map(tuple, candidate.model.tolist())) & set(map(tuple, candidate.clean.tolist()))
        along = candidate.clean @ candidate.toward_hidden
        lost = np.delete(along, candidate.kept)
        assert along[candidate.kept].max() <= lost.min() + 2 * 5 * 0.003  # but for the least noise
        offset = np.abs(candidate.noisy - candidate.clean)
        assert np.median(offset) == pytest.approx(0.6745 * candidate.severity["noise"], rel=0.5)
        assert np.abs(candidate.noisy).max() < 0.5 + 6 * candidate.severity["noise"]


def test_a_partial_model_is_whole_without_overlap_and_changes_no_draw_of_others(subjects):
    for k in range(8):
        random = np.random.default_rng(k)
        usual = draw_candidate(subjects[0].surface, np.ones(3, bool), SETTINGS, np.random.default_rng(k))
        partial = draw_candidate(subjects[0].surface, np.ones(3, bool), replace(SETTINGS, partial=1.0), random)
        assert np.array_equal(partial.whole_model, usual.model) and np.array_equal(partial.noisy, usual.noisy)
        assert np.array_equal(partial.reference((NOISE, POSE)), usual.model)
        lacking = partial.reference((OVERLAP,))
        to_model = np.linalg.norm(usual.model[:, None] - lacking, axis=2).min(axis=1)
        assert 0.02 < (to_model > 0.12).mean() < 0.7
        assert partial.changing_reference((POSE, OVERLAP)) == (OVERLAP,)
    unhidden = draw_candidate(
        subjects[0].surface, np.zeros(3, bool), replace(SETTINGS, partial=1.0), np.random.default_rng(0)
    )
    assert unhidden.whole_model is None


def test_every_subset_of_the_causes_is_drawn():
    random = np.random.default_rng(0)
    drawn = np.array([draw_applied(CauseSettings(present=0.25), random) for _ in range(2000)])
    assert drawn.mean(axis=0) == pytest.approx(0.25, abs=0.04)
    assert len(np.unique(drawn, axis=0)) == 8


CONFIG = with_defaults()
FEWER = {"train": 12, "test": 6, "clean_pairs": 20, "points": (128, 256)}
LIMITS = {"nominal": 0.02, "failed": 0.03}
CAUSES = CONFIG["causes"] | {"limits": LIMITS, "shares": CONFIG["controls"]["hard"]["shares"]}


@pytest.mark.parametrize("settings", [CAUSES, CONFIG["causes"] | CONFIG["controls"]["hard"]], ids=["causes", "hard"])
def test_a_rule_of_three_lines_is_near_chance(four, settings):
    causes, _, _ = draw_causes(four, "four", 100, CauseSettings.from_dict(settings | FEWER))
    label_S = labels_of(causes.truth)
    named_S = np.array(CONCEPTS)[ThresholdRule("four", 100).scores(causes.registrations).argmax(axis=1)]
    recall = [(named_S[label_S == concept] == concept).mean() for concept in CONCEPTS]
    assert set(label_S) == set(CONCEPTS)
    assert np.mean(recall) <= 1 / 3 + 0.1


MEASURED = CauseSettings(points=(128, 192))
XI = np.random.default_rng(100).normal(size=(13, 6)) * MEASURED.deviation_6()


def candidate_of(subject, *applied):
    return draw_candidate(subject.surface, np.array(applied, bool), MEASURED, np.random.default_rng(7))


def counterfactuals(candidate, subject):
    return Counterfactuals(Registrar(candidate, MEASURED), subject.errors, XI, MEASURED)


@pytest.fixture(scope="module")
def drill(subjects):
    return subjects[2]


@pytest.mark.parametrize("subset", range(8))
def test_the_error_is_the_mean_over_the_starts_and_is_cut_off(drill, subset):
    """Against the plain form: one ICP, one ADD after the other."""
    candidate = candidate_of(drill, True, True, True)
    causes = tuple(i for i in range(3) if subset >> i & 1)
    errors = []
    for T in exp(XI):
        start = inverse(T @ (candidate.T_init if 1 in causes else candidate.T_near))
        icp = BatchedICP(candidate.observed(causes), MEASURED.icp)
        [pose], _, _ = icp.register(candidate.model, start[None])
        errors.append(min(pose_error(drill.surface[:256], pose, np.eye(4), symmetric=False), 0.5))
    assert counterfactuals(candidate, drill).error(subset) == pytest.approx(np.mean(errors), abs=1e-9)


def test_missing_surface_hurts_the_model_on_its_way_and_hardly_what_was_observed(drill):
    dense = replace(MEASURED, points=(512, 512), severities=replace(MEASURED.severities, crop=(0.7, 0.7)))
    applied = np.array([False, False, True])
    candidate = draw_candidate(drill.surface, applied, dense, np.random.default_rng(7))
    errors = {}
    for moved in ("model", "observed"):
        settings = replace(dense, moved=moved)
        errors[moved] = Counterfactuals(Registrar(candidate, settings), drill.errors, XI, settings).error(7)
    assert errors["observed"] < 0.5 * errors["model"]


def test_an_absent_cause_cannot_be_removed_and_the_uncertainty_is_the_divergence_from_none(drill):
    measured = counterfactuals(candidate_of(drill, True, False, False), drill)
    assert {measured.error(subset) for subset in (0, 2, 4, 6)} == {measured.error(0)}
    assert {measured.error(subset) for subset in (1, 3, 5, 7)} == {measured.error(7)}
    assert measured.error(0) != measured.error(7)
    clean = counterfactuals(candidate_of(drill, False, False, False), drill)
    assert clean.error(7) < 0.02 and clean.uncertainty(7) == 0
    measured = counterfactuals(candidate_of(drill, True, True, True), drill)
    expected = divergence(measured.covariance(0), measured.covariance(7), MEASURED.floor)
    assert measured.uncertainty(7) == pytest.approx(float(expected))
    assert measured.uncertainty(7) > 0


def test_a_registration_without_correspondences_or_a_finite_error_has_no_truth(drill, monkeypatch):
    candidate = candidate_of(drill, False, True, False)
    far = candidate.T_init.copy()
    far[:3, 3] = 50
    measured = counterfactuals(replace(candidate, T_init=far), drill)
    assert measured.error(0) < 0.02
    with pytest.raises(Unmeasurable, match="no correspondences"):
        measured.error(7)
    monkeypatch.setattr(PoseErrors, "__call__", lambda self, T_n: np.full(len(T_n), np.nan))
    with pytest.raises(Unmeasurable, match="not finite"):
        counterfactuals(candidate, drill).error(0)


def test_a_can_that_is_turned_about_its_axis_is_where_it_was(subjects):
    can = subjects[0]
    assert can.symmetric
    turned = exp(np.array([[0, 0, 1.0, 0, 0, 0]]))
    assert can.errors(turned)[0] < 0.015  # the spacing of the points
    assert PoseErrors(can.surface, 256, symmetric=False)(turned)[0] > 0.2
