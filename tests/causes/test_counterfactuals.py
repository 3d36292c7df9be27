from dataclasses import replace

import numpy as np
import pytest

from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.pose_error import PoseErrors, pose_error
from gpca.alignment.rigid import exp, inverse
from gpca.causes.candidate import Counterfactuals, Registrar, Unmeasurable, draw_candidate
from gpca.causes.settings import CauseSettings
from gpca.uncertainty.spread import divergence

SETTINGS = CauseSettings(points=(128, 192))
XI = np.random.default_rng(100).normal(size=(13, 6)) * SETTINGS.deviation_6()


def candidate_of(subject, *applied):
    return draw_candidate(subject.surface, np.array(applied, bool), SETTINGS, np.random.default_rng(7))


def counterfactuals(candidate, subject):
    return Counterfactuals(Registrar(candidate, SETTINGS), subject.errors, XI, SETTINGS)


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
        icp = BatchedICP(candidate.observed(causes), SETTINGS.icp)
        [pose], _, _ = icp.register(candidate.model, start[None])
        errors.append(min(pose_error(drill.surface[:256], pose, np.eye(4), symmetric=False), 0.5))
    assert counterfactuals(candidate, drill).error(subset) == pytest.approx(np.mean(errors), abs=1e-9)


def test_missing_surface_hurts_the_model_on_its_way_and_hardly_what_was_observed(drill):
    dense = replace(SETTINGS, points=(512, 512), severities=replace(SETTINGS.severities, crop=(0.7, 0.7)))
    applied = np.array([False, False, True])
    candidate = draw_candidate(drill.surface, applied, dense, np.random.default_rng(7))
    errors = {}
    for moved in ("model", "observed"):
        settings = replace(dense, moved=moved)
        errors[moved] = Counterfactuals(Registrar(candidate, settings), drill.errors, XI, settings).error(7)
    assert errors["observed"] < 0.5 * errors["model"]


def test_an_absent_cause_cannot_be_removed(drill):
    measured = counterfactuals(candidate_of(drill, True, False, False), drill)
    assert {measured.error(subset) for subset in (0, 2, 4, 6)} == {measured.error(0)}
    assert {measured.error(subset) for subset in (1, 3, 5, 7)} == {measured.error(7)}
    assert measured.error(0) != measured.error(7)


def test_a_pair_without_causes_ends_at_the_truth(drill):
    measured = counterfactuals(candidate_of(drill, False, False, False), drill)
    assert measured.error(7) < 0.02
    assert measured.uncertainty(7) == 0


def test_the_uncertainty_is_the_divergence_from_the_clean_pair(drill):
    measured = counterfactuals(candidate_of(drill, True, True, True), drill)
    expected = divergence(measured.covariance(0), measured.covariance(7), SETTINGS.floor)
    assert measured.uncertainty(7) == pytest.approx(float(expected))
    assert measured.uncertainty(7) > 0


def test_a_registration_without_correspondences_has_no_truth(drill):
    candidate = candidate_of(drill, False, True, False)
    far = candidate.T_init.copy()
    far[:3, 3] = 50
    measured = counterfactuals(replace(candidate, T_init=far), drill)
    assert measured.error(0) < 0.02
    with pytest.raises(Unmeasurable, match="no correspondences"):
        measured.error(7)


def test_an_error_that_is_not_finite_is_no_truth(drill, monkeypatch):
    monkeypatch.setattr(PoseErrors, "__call__", lambda self, T_n: np.full(len(T_n), np.nan))
    with pytest.raises(Unmeasurable, match="not finite"):
        counterfactuals(candidate_of(drill, False, False, False), drill).error(0)


def test_a_can_that_is_turned_about_its_axis_is_where_it_was(subjects):
    can = subjects[0]
    assert can.symmetric
    turned = exp(np.array([[0, 0, 1.0, 0, 0, 0]]))
    assert can.errors(turned)[0] < 0.015  # the spacing of the points
    assert PoseErrors(can.surface, 256, symmetric=False)(turned)[0] > 0.2


def test_many_errors_at_once_are_those_of_one_after_the_other(subjects):
    poses = exp(np.random.default_rng(1).normal(scale=0.2, size=(5, 6)))
    drill, can = subjects[2], subjects[0]
    expected = [pose_error(drill.surface[:256], T, np.eye(4), symmetric=False) for T in poses]
    assert drill.errors(poses) == pytest.approx(np.array(expected))
    whole = PoseErrors(can.surface, len(can.surface), symmetric=True)
    assert whole(poses) == pytest.approx(np.array([pose_error(can.surface, T, np.eye(4), True) for T in poses]))
