"""The probability that a pose is off by more than a tolerance."""

import numpy as np
import pytest

from gpca.guarantee.guarantee import calibrate
from gpca.model.result import TOLERANCES, Calibrated, Evidence, ResultJudge, level_at


def evidence_of(error_N, seed=0):
    """Two hypotheses, of which the first knows the error up to a fifth."""
    random = np.random.default_rng(seed)
    first_N = error_N * np.exp(0.2 * random.normal(size=len(error_N)))
    distance_N_2 = np.column_stack([first_N, random.uniform(0.1, 0.4, size=len(error_N))])
    second_N = random.uniform(0, 0.02, size=len(error_N))
    return Evidence(distance_N_2, np.column_stack([1 - second_N, second_N]), 0.02 + error_N / 5, 1 - error_N)


@pytest.fixture(scope="module")
def judge():
    error_N = np.exp(np.random.default_rng(1).uniform(np.log(0.002), np.log(0.4), size=600))
    return ResultJudge.fit(evidence_of(error_N), error_N)


def test_a_pose_is_likelier_off_the_farther_it_is_and_the_smaller_the_tolerance(judge):
    error_N = np.array([0.004, 0.025, 0.036, 0.3])
    evidence = Evidence(error_N[:, None], np.ones((4, 1)), 0.02 + error_N / 5, 1 - error_N)
    at_3, at_10 = (judge.probability(evidence, tolerance) for tolerance in (0.03, 0.1))
    assert (np.diff(at_3) > 0).all()
    assert (at_10[:3] < at_3[:3]).all()
    assert at_3[0] < 0.02
    assert at_3[3] > 0.98
    np.testing.assert_allclose(judge.error(evidence), error_N, rtol=0.5)


@pytest.mark.parametrize("tolerance", [0.015, *TOLERANCES])
def test_the_probability_is_that_of_the_errors_at_any_tolerance(judge, tolerance):
    error_N = np.exp(np.random.default_rng(2).uniform(np.log(0.002), np.log(0.4), size=2000))
    told_N = judge.probability(evidence_of(error_N, 3), tolerance)
    off_N = error_N > tolerance
    assert told_N.mean() == pytest.approx(off_N.mean(), abs=0.03)
    for low, high in ((0, 0.2), (0.8, 1.0)):
        inside_N = (told_N >= low) & (told_N <= high)
        assert off_N[inside_N].mean() == pytest.approx(told_N[inside_N].mean(), abs=0.05)


def test_descriptors_of_a_registration_tell_what_the_evidence_does_not_and_a_larger_tolerance_is_kept_more_often():
    random = np.random.default_rng(5)
    error_N = np.exp(random.uniform(np.log(0.002), np.log(0.4), size=600))
    blind = evidence_of(random.permutation(error_N))
    described_N_3 = np.column_stack([error_N, random.normal(size=(600, 2))])
    told = ResultJudge.fit(blind, error_N, described_N_3)
    off_N = error_N > 0.03
    given_N, registered_N = told.probability(blind, 0.03), told.probability(blind, 0.03, described_N_3)
    assert abs(given_N[off_N].mean() - given_N[~off_N].mean()) < 0.1  # a pose that is given has no descriptors
    assert registered_N[off_N].mean() > 0.8 > 0.3 > registered_N[~off_N].mean()
    falling = np.diff([told.probability(blind, each, described_N_3) for each in np.geomspace(0.01, 0.1, 9)], axis=0)
    assert (falling <= 1e-12).all()
    again = ResultJudge.from_state(told.state())
    np.testing.assert_array_equal(again.probability(blind, 0.03, described_N_3), registered_N)


def test_without_training_it_is_the_weight_of_poses_apart_from_the_result():
    evidence = Evidence(np.array([[0.001, 0.2]]), np.array([[0.7, 0.3]]), np.array([0.02]), np.array([0.9]))
    assert ResultJudge.untrained().probability(evidence, 0.03) == pytest.approx(0.3, abs=0.002)


def test_what_is_promised_between_two_tolerances_is_what_both_allow_and_beyond_them_nothing():
    random, levels = np.random.default_rng(4), []
    for tolerance, threshold, sure in ((0.02, 0.6, 1.0), (0.03, 0.4, 0.5)):
        state_N = np.where(random.random(400) < 0.5, "nominal", "pose")
        nominal_N = np.where(state_N == "nominal", 1, 0) * sure + random.random(400) * (1 - sure)
        scores_N_5 = np.column_stack([nominal_N, *[0 * nominal_N] * 4])
        levels.append(Calibrated(tolerance, threshold, calibrate(scores_N_5, state_N)))
    for level in levels:
        rounded = level_at(levels, level.tolerance * (1 + 1e-15))
        assert (rounded.threshold, rounded.guarantee) == (level.threshold, level.guarantee)
    between = level_at(levels, 0.025)
    one, two = (level.guarantee for level in levels)
    assert between.threshold == 0.6
    assert between.guarantee.state_sets.limits == tuple(map(max, one.state_sets.limits, two.state_sets.limits))
    alarms = [guarantee.failure_alarm for guarantee in (one, two, between.guarantee)]
    assert alarms[2].good_below == min(alarm.good_below for alarm in alarms)
    assert alarms[2].failed_from == max(alarm.failed_from for alarm in alarms)
    for beyond, threshold in ((0.01, 0.6), (0.2, 0.4)):
        assert level_at(levels, beyond) == Calibrated(beyond, threshold)
