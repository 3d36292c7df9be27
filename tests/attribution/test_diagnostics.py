from itertools import permutations

import numpy as np
import pytest

from gpca.attribution import diagnostics as d

RANDOM = np.random.default_rng(0)
WRONG = RANDOM.uniform(size=4000) < 0.1
E = WRONG.mean()


def confident(p, n_classes=3):
    """Probabilities with `p` for class 0 and the rest shared."""
    p = np.asarray(p, float)
    return np.column_stack([p, *[(1 - p) / (n_classes - 1)] * (n_classes - 1)])


def test_areas_of_the_perfect_a_random_and_the_worst_order():
    perfect, constant, worst = ~WRONG, np.zeros(len(WRONG)), WRONG
    areas = (E + (1 - E) * np.log(1 - E), E, worst_aurc(E))
    generalized = (E**2 / 2, E / 2, E - E**2 / 2)
    for confidence, area, of_failures in zip((perfect, constant, worst), areas, generalized, strict=True):
        assert d.aurc(confidence, WRONG) == pytest.approx(area, abs=1e-3)
        assert d.augrc(confidence, WRONG) == pytest.approx(of_failures, abs=1e-3)
    assert d.excess_aurc(perfect, WRONG) == 0
    assert d.aurc(constant, WRONG) == pytest.approx(E)
    assert d.aurc(RANDOM.normal(size=len(WRONG)), WRONG) == pytest.approx(E, abs=0.02)


def worst_aurc(error_rate):
    """The largest area that an error rate e allows, in the limit of many samples: e (1 + ln 1/e)."""
    return error_rate * (1 - np.log(error_rate))


def test_ties_are_the_mean_over_their_orders():
    wrong = np.array([True, False, False, True, False])
    confidence = np.array([2, 2, 2, 1, 1])
    tied = [sorted(range(5), key=lambda i: (-confidence[i], order.index(i))) for order in permutations(range(5))]
    areas = [np.mean(np.cumsum(wrong[order]) / np.arange(1, 6)) for order in map(np.array, tied)]
    assert d.aurc(confidence, wrong) == pytest.approx(np.mean(areas))


@pytest.mark.parametrize("all_wrong", [False, True])
def test_all_right_and_all_wrong_have_defined_areas(all_wrong):
    wrong = np.full(20, all_wrong)
    assert d.aurc(np.arange(20), wrong) == float(all_wrong)
    assert d.excess_aurc(np.arange(20), wrong) == 0
    assert d.augrc(np.arange(20), wrong) == (pytest.approx(0.525) if all_wrong else 0)


def test_calibrated_predictions_have_no_error_overconfident_ones_their_excess_and_in_a_bin_signs_cancel():
    p = RANDOM.uniform(0.4, 1, size=20000)
    target = np.where(RANDOM.uniform(size=len(p)) < p, 0, 1)
    assert d.calibration_error(confident(p), target) < 0.015
    assert d.calibration_error(confident(np.full(1000, 0.95)), np.arange(1000) % 10 // 7) == pytest.approx(0.25)
    assert d.calibration_error(confident(np.ones(10)), np.arange(10) % 2) == pytest.approx(0.5)
    p = np.concatenate([np.full(160, 0.94), np.full(140, 0.99)])
    target = np.concatenate([np.zeros(160), np.arange(140) % 10 == 0]).astype(int)
    overall = abs(160 * (0.94 - 1) + 140 * (0.99 - 0.9)) / 300
    assert d.calibration_error(confident(p), target) == pytest.approx(overall)
