from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from baselines.shap_kl import shapley_values
from gpca.explainers.registry import explainer_entry
from gpca.pairs.perturbation import CONCEPTS
from gpca.uncertainty.designs import DESIGNS

PRESENT_8_3 = (
    np.arange(8)[:, None] >> np.arange(3)
) & 1  # which features corner b has, as gpca.uncertainty.designs numbers them


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


@pytest.fixture(scope="module")
def attached(registrations):
    """With 11 conditions as of design ``additive``: the knob of the true concept adds 3 nats, the others some 0.3.

    The numbers of calls and the seconds tell which conditions were counted.
    """
    true_S_3 = registrations.concept[:, None] == np.array(CONCEPTS)
    random = np.random.default_rng(0)
    gain_S_3 = np.where(true_S_3, 3.0, random.uniform(0.1, 0.5, size=true_S_3.shape))
    knobs_K_3 = np.vstack([PRESENT_8_3, 0.1 * np.eye(3)])
    calls_S_K = np.arange(len(registrations))[:, None] + 2 ** np.arange(11)
    arrays = {"uncertainty": gain_S_3 @ knobs_K_3.T, "icp_calls": calls_S_K}
    arrays |= {"icp_seconds": 1e-3 * calls_S_K, "seconds": 2e-3 * calls_S_K}
    return replace(registrations, attached=arrays)


def explain(name, registrations):
    return explainer_entry(name).make("tiny", 0).explain(registrations)


def with_uncertainty(registrations, uncertainty):
    return replace(registrations, attached={**registrations.attached, "uncertainty": uncertainty})


def test_the_corners_are_numbered_as_the_designs_name_them():
    names = ["+".join(np.array(CONCEPTS)[row == 1]) or "untouched" for row in PRESENT_8_3]
    assert [*DESIGNS["oracle"].conditions] == names
    assert [*DESIGNS["additive"].conditions][:8] == names


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


def test_the_knob_that_raises_the_uncertainty_most_names_the_concept(attached):
    attribution = explain("shap_additive", attached.without_labels())
    assert attribution.predicted_N.tolist() == attached.concept.tolist()
    gain_S_3 = attached.attached["uncertainty"][:, 8:] / 0.1
    assert attribution.scores_N_C == pytest.approx(gain_S_3)
    assert not attribution.abstained_N.any()


def test_the_eight_corners_are_charged_and_the_steps_are_not(attached):
    attribution = explain("shap_additive", attached)
    expected_N = 8 * np.arange(len(attached)) + 2**8 - 1
    assert np.array_equal(attribution.icp_calls_N, expected_N)
    assert attribution.icp_seconds_N == pytest.approx(1e-3 * expected_N)
    assert (attribution.seconds_N > 2e-3 * expected_N).all()
    assert np.isfinite(attribution.seconds_N).all()


def test_where_no_knob_changes_anything_no_concept_is_named(attached):
    uncertainty = attached.attached["uncertainty"].copy()
    uncertainty[[0, 5]] = [[0.0], [7.3]]
    attribution = explain("shap_additive", with_uncertainty(attached, uncertainty))
    assert np.flatnonzero(attribution.abstained_N).tolist() == [0, 5]
    assert np.flatnonzero(attribution.predicted_N == "").tolist() == [0, 5]
    assert np.array_equal(attribution.scores_N_C[[0, 5]], np.zeros((2, 3)))


def test_the_oracle_gives_the_true_concept_all_of_the_value(attached):
    """Two of the true knobs are at rest, so the uncertainty has two levels (dummy axiom)."""
    entry = explainer_entry("shap_oracle")
    assert entry.oracle
    assert "oracle" in entry.title
    true_S_3 = attached.concept[:, None] == np.array(CONCEPTS)
    height_S = np.random.default_rng(0).uniform(0.1, 50, size=len(attached))
    present_S_8 = true_S_3 @ PRESENT_8_3.T
    attribution = explain("shap_oracle", with_uncertainty(attached, 0.2 + height_S[:, None] * present_S_8))
    assert attribution.scores_N_C == pytest.approx(height_S[:, None] * true_S_3, abs=1e-9)
    assert attribution.predicted_N.tolist() == attached.concept.tolist()
