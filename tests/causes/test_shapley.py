from itertools import permutations

import numpy as np
import pytest

from baselines.shap_kl import shapley_values as by_library
from gpca.causes.truth import ALL, NONE, SUBSETS, shapley_values

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


def test_the_values_add_up_to_what_all_causes_do():
    worth = RANDOM.normal(size=(50, 8))
    assert shapley_values(worth).sum(axis=1) == pytest.approx(worth[:, ALL] - worth[:, NONE], abs=1e-12)


def test_a_cause_that_changes_nothing_has_no_part():
    worth = RANDOM.normal(size=(5, 8))
    worth[:, [2, 3, 6, 7]] = worth[:, [0, 1, 4, 5]]
    assert (shapley_values(worth)[:, 1] == 0).all()


def test_subsets_are_numbered_by_bits():
    assert SUBSETS[NONE] == ()
    assert SUBSETS[ALL] == (0, 1, 2)
    assert SUBSETS[5] == (0, 2)
