from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from baselines.shap_kl import shapley_values
from gpca.explainers.registry import explainer_entry
from gpca.pairs.perturbation import CONCEPTS

# Which features corner b has, as gpca.uncertainty.designs numbers them.
PRESENT_8_3 = (np.arange(8)[:, None] >> np.arange(3)) & 1


def shapley_sum(worth_8):
    """The mean over all orders in which features arrive of what each adds when it does."""
    values_3 = np.zeros(3)
    for order in permutations(range(3)):
        corner = 0
        for feature in order:
            values_3[feature] += (worth_8[corner | 1 << feature] - worth_8[corner]) / 6
            corner |= 1 << feature
    return values_3


def games(n, seed=0):
    return np.random.default_rng(seed).normal(size=(n, 8))


@pytest.mark.parametrize("n", [1, 2, 40])
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e4])
def test_values_equal_the_closed_form_sum(n, scale):
    worth = scale * games(n)
    values = shapley_values(worth)
    assert values.shape == (n, 3)
    assert values / scale == pytest.approx(np.array([shapley_sum(row) for row in worth]) / scale, abs=1e-6)


def test_games_of_very_different_scale_do_not_disturb_one_another():
    worth = games(5) * np.array([[1e-6], [1e4], [1.0], [1e4], [1e-6]])
    alone = np.vstack([shapley_values(row[None]) for row in worth])
    assert shapley_values(worth) == pytest.approx(alone, rel=1e-9)


def test_the_oracle_gives_the_true_concept_all_of_the_value(registrations):
    """Two of the true knobs are at rest, so the uncertainty has two levels (dummy axiom)."""
    entry = explainer_entry("shap_oracle")
    assert entry.oracle
    assert "oracle" in entry.title
    true_S_3 = registrations.concept[:, None] == np.array(CONCEPTS)
    height_S = np.random.default_rng(0).uniform(0.1, 50, size=len(registrations))
    none = np.zeros((len(registrations), 8))
    arrays = {"uncertainty": 0.2 + height_S[:, None] * (true_S_3 @ PRESENT_8_3.T)}
    arrays |= dict.fromkeys(("seconds", "icp_seconds", "icp_calls"), none)
    attribution = entry.make("tiny", 0).explain(replace(registrations, attached=arrays))
    assert attribution.scores_N_C == pytest.approx(height_S[:, None] * true_S_3, abs=1e-9)
    assert attribution.predicted_N.tolist() == registrations.concept.tolist()
