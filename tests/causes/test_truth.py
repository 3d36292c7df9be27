from itertools import permutations

import numpy as np
import pytest

from baselines.shap_kl import shapley_values as by_library
from gpca.causes.truth import ALL, NONE, Truth, shapley_values

LIMITS = {"nominal_limit": 0.02, "failed_limit": 0.03, "cause_limit": 0.01, "uncertainty_limit": 5.0}


def truth(*errors, u=0.0):
    """Of samples whose errors are given for all eight subsets, or for none and all."""
    rows = [row if len(row) == 8 else (row[0],) * 7 + row[1:] for row in errors]
    return Truth(np.array(rows), np.full((len(rows), 8), u) * (np.arange(8) > 0), **LIMITS)


def additive(none, *parts):
    return tuple(none + sum(part for i, part in enumerate(parts) if subset >> i & 1) for subset in range(8))


def test_states_follow_the_limits_of_the_error_and_of_the_uncertainty():
    found = truth((0.01, 0.0199), (0.01, 0.02), (0.01, 0.03), (0.01, 0.0301), (0.01, 0.5))
    assert found.state.tolist() == ["nominal", "borderline", "borderline", "failed", "failed"]
    assert truth((0.01, 0.01), u=5.0).state.tolist() == ["nominal"]
    assert truth((0.01, 0.01), u=5.1).state.tolist() == ["borderline"]
    assert truth((0.01, 0.2), u=0.0).state.tolist() == ["failed"]  # certain of the wrong pose


def test_the_dominant_cause_adds_most_is_tied_with_what_adds_nearly_as_much_and_may_be_geometry():
    found = truth(additive(0.01, 0.02, 0.2, 0.005), additive(0.01, -0.005, 0, 0.1))  # what helps has a negative part
    assert found.phi == pytest.approx(np.array([[0.02, 0.2, 0.005], [-0.005, 0, 0.1]]))
    assert found.dominant.tolist() == ["pose", "overlap"]
    assert found.causes.tolist() == [[True, True, False], [False, False, True]]
    found = truth(additive(0.05, 0.01, 0, 0), additive(0.05, 0.2, 0, 0), additive(0.019, 0, 0, 0))
    assert found.geometry.tolist() == [True, True, False]
    assert found.dominant.tolist()[:2] == ["geometry", "noise"]
    found = truth(additive(0.01, 0.1, 0.0901, 0.08), additive(0.01, 0.2, 0, 0))
    assert found.tied.tolist() == [[True, True, False], [True, False, False]]
    assert found.margin == pytest.approx([0.0099, 0.2])
    assert found.subset(np.array([1])).margin == pytest.approx([0.2])


RANDOM = np.random.default_rng(100)


def by_orders(worth_8):
    """The mean over all orders in which the concepts can come in, of what each adds when it comes."""
    phi = np.zeros(3)
    for order in permutations(range(3)):
        present = 0
        for i in order:
            phi[i] += (worth_8[present | 1 << i] - worth_8[present]) / 6
            present |= 1 << i
    return phi


def test_the_values_are_those_of_all_orders_and_of_the_library():
    worth = RANDOM.normal(size=(20, 8))
    expected = np.array([by_orders(row) for row in worth])
    assert shapley_values(worth) == pytest.approx(expected, abs=1e-12)
    assert shapley_values(worth) == pytest.approx(by_library(worth), abs=1e-6)
    assert shapley_values(worth).sum(axis=1) == pytest.approx(worth[:, ALL] - worth[:, NONE], abs=1e-12)
    # A cause that changes nothing has no part.
    worth[:, [2, 3, 6, 7]] = worth[:, [0, 1, 4, 5]]
    assert (shapley_values(worth)[:, 1] == 0).all()
