"""Diagnostics of draws: those of samples that are repeated."""

import numpy as np
import pytest

from gpca.attribution import diagnostics

S = 30
RANDOM = np.random.default_rng(0)
P = RANDOM.dirichlet([0.6, 0.6, 0.6], S)
TARGET = RANDOM.integers(3, size=S)
WRONG = P.argmax(axis=1) != TARGET
TIED = np.round(P.max(axis=1), 1)
OTHER = RANDOM.integers(5, size=S).astype(float)
WEIGHTS = np.vstack([np.ones(S), RANDOM.integers(4, size=(20, S)), RANDOM.integers(3, size=(5, S)) * 2])


def repeated(function, *arrays):
    return [function(*(np.repeat(array, of_draw.astype(int), axis=0) for array in arrays)) for of_draw in WEIGHTS]


def test_calibration_errors_are_those_of_repeated_samples_and_alike_ones_have_no_order():
    expected = repeated(diagnostics.calibration_error, P, TARGET)
    assert diagnostics.calibration_error(P, TARGET, WEIGHTS) == pytest.approx(expected)
    weights = np.zeros((2, S))
    weights[0, :2] = 3
    one = np.append([0.1, 0.1], np.arange(S - 2))
    assert diagnostics.rank_correlation(one, OTHER, weights)[0] == 0
    assert np.isnan(diagnostics.aurc(one, WRONG, weights)[1])
    assert np.isnan(diagnostics.calibration_error(P, TARGET, weights)[1])


@pytest.mark.parametrize("name", ["aurc", "excess_aurc", "augrc"])
@pytest.mark.parametrize("confidence", [P.max(axis=1), TIED, np.zeros(S)])
def test_areas_are_those_of_repeated_samples(name, confidence):
    expected = repeated(getattr(diagnostics, name), confidence, WRONG)
    assert getattr(diagnostics, name)(confidence, WRONG, WEIGHTS) == pytest.approx(expected)


@pytest.mark.parametrize("one", [P.max(axis=1), TIED, np.zeros(S)])
def test_rank_correlations_are_those_of_repeated_samples(one):
    expected = repeated(diagnostics.rank_correlation, one, OTHER)
    assert diagnostics.rank_correlation(one, OTHER, WEIGHTS) == pytest.approx(expected)
