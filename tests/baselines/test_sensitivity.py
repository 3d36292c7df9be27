from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import rankdata

from baselines.sensitivity import local_derivatives, partial_rank_correlations, total_indices
from gpca.explainers.registry import explainer_entry
from gpca.pairs.perturbation import CONCEPTS
from gpca.uncertainty.designs import STEP, sample_knobs
from gpca.uncertainty.interventions import UNTOUCHED, UPPER
from gpca.uncertainty.settings import CORNERS

KINDS = {"sa_prcc_additive": "latin", "sa_sobol_additive": "saltelli"}
ADDITIVE = ("shap_additive", "sa_local_additive", *KINDS)
# Weights with which no knob alone decides the order of the outputs, in which the first counts most.
WEIGHTS_3 = np.array([4.0, 1.0, 0.5])


def explain(name, registrations):
    return explainer_entry(name).make("tiny", 0).explain(registrations)


def unit_knobs(name):
    """The settings (K, 3) behind the conditions of that explainer's design, each knob in units of its range."""
    if name not in KINDS:
        return np.vstack([CORNERS, STEP * np.eye(3)])
    settings_K_3 = np.vstack([UNTOUCHED, sample_knobs(KINDS[name])])
    return (settings_K_3 - UNTOUCHED) / np.subtract(UPPER, UNTOUCHED)


def with_uncertainty(name, registrations):
    """An uncertainty that rises most with the knob of the true concept, and calls that tell the conditions apart."""
    places_S = [CONCEPTS.index(concept) for concept in registrations.concept]
    weights_S_3 = np.array([np.roll(WEIGHTS_3, place) for place in places_S])
    uncertainty_S_K = weights_S_3 @ unit_knobs(name).T + 5
    calls_S_K = np.arange(len(registrations))[:, None] + np.arange(uncertainty_S_K.shape[1]) ** 2
    arrays = {"uncertainty": uncertainty_S_K, "icp_calls": calls_S_K, "icp_seconds": 0.1 * calls_S_K}
    return replace(registrations, attached=arrays | {"seconds": 0.2 * calls_S_K})


def partial_correlation(inputs_K_3, output_K, i):
    """What the ranks of input i and of the output have in common once the other inputs' ranks are regressed out."""
    ranks_K_3 = rankdata(inputs_K_3, axis=0)
    others = np.column_stack([np.ones(len(output_K)), np.delete(ranks_K_3, i, axis=1)])
    left = [
        ranks_K - others @ np.linalg.lstsq(others, ranks_K, rcond=None)[0]
        for ranks_K in (ranks_K_3[:, i], rankdata(output_K))
    ]
    return np.corrcoef(*left)[0, 1]


def saltelli(base):
    from SALib.sample import sobol

    problem = {"num_vars": 3, "names": ["x", "y", "z"], "bounds": [[0, 1]] * 3}
    return sobol.sample(problem, base, calc_second_order=False, seed=1)


def test_derivatives_are_forward_differences_and_what_never_changes_has_no_sensitivity():
    uncertainty = np.array([[2.0, *[99.0] * 7, 2.5, 1.0, 2.0], [0.0, *[99.0] * 7, 1e-6, 0.0, 1e4]])
    assert local_derivatives(uncertainty) == pytest.approx(np.array([[0.5, -1, 0], [1e-6, 0, 1e4]]) / STEP)
    constant = np.array([[0.0], [7.3], [1e-12]])
    assert np.array_equal(partial_rank_correlations(sample_knobs("latin"), np.tile(constant, 24)), np.zeros((3, 3)))
    assert np.array_equal(total_indices(sample_knobs("saltelli"), np.tile(constant, 40)), np.zeros((3, 3)))
    assert np.array_equal(local_derivatives(np.tile(constant, 11)), np.zeros((3, 3)))


@pytest.mark.parametrize("k", [16, 24, 200])
def test_prcc_equals_the_correlation_of_the_residuals_of_the_ranks(k):
    random = np.random.default_rng(k)
    inputs = random.uniform(size=(k, 3))
    inputs[:, 1] += inputs[:, 0]  # correlated inputs, for which a plain rank correlation differs
    outputs = np.exp(inputs @ random.normal(size=(3, 6))).T + random.normal(size=(6, k))
    outputs[0] = np.round(outputs[0])  # ties
    expected = [[partial_correlation(inputs, output, i) for i in range(3)] for output in outputs]
    assert partial_rank_correlations(inputs, outputs) == pytest.approx(np.array(expected), abs=1e-9)


def test_total_indices_equal_the_analytic_ones():
    settings = saltelli(4096)
    angles = np.pi * (2 * settings - 1)
    weights = np.array([4.0, -2.0, 1.0])
    ishigami = np.sin(angles[:, 0]) * (1 + 0.1 * angles[:, 2] ** 4) + 7 * np.sin(angles[:, 1]) ** 2
    outputs = np.array([settings @ weights, 1e-6 * (settings @ weights), 1e4 + settings[:, 2], ishigami])
    # Of Ishigami's function with a = 7, b = 0.1: Sobol & Levitan 1999.
    first, third = 0.5 * (1 + 0.1 * np.pi**4 / 5) ** 2, 0.1**2 * np.pi**8 * (1 / 18 - 1 / 50)
    second = 7**2 / 8
    analytic = np.array([first + third, second, third]) / (first + second + third)
    linear = weights**2 / np.sum(weights**2)
    assert total_indices(settings, outputs) == pytest.approx(np.array([linear, linear, [0, 0, 1], analytic]), abs=0.01)


@pytest.mark.parametrize("name", ADDITIVE)
def test_the_knob_that_changes_the_uncertainty_most_names_the_concept_and_is_charged(name, registrations):
    attached = with_uncertainty(name, registrations)
    attribution = explain(name, attached.without_labels())
    assert attribution.predicted_N.tolist() == attached.concept.tolist()
    assert np.isfinite(attribution.scores_N_C).all()
    rows = np.array([7, 50, 3])
    assert explain(name, attached.subset(rows)).scores_N_C == pytest.approx(attribution.scores_N_C[rows], abs=1e-12)

    if name not in KINDS:  # a slope in nats per range, a Shapley value
        assert np.sort(attribution.scores_N_C) == pytest.approx(np.tile(np.sort(WEIGHTS_3), (len(registrations), 1)))
    counted = {"sa_local_additive": [0, 8, 9, 10], "shap_additive": range(8)}.get(name, range(len(unit_knobs(name))))
    calls_N = attached.attached["icp_calls"][:, counted].sum(axis=1)
    assert np.array_equal(attribution.icp_calls_N, calls_N)
    assert attribution.icp_seconds_N == pytest.approx(0.1 * calls_N)
    assert (attribution.seconds_N > 0.2 * calls_N).all()
    assert not attribution.abstained_N.any()
    uncertainty = attached.attached["uncertainty"].copy()
    uncertainty[[0, 5]] = [[0.0], [7.3]]
    constant = replace(attached, attached={**attached.attached, "uncertainty": uncertainty})
    attribution = explain(name, constant)
    assert np.flatnonzero(attribution.abstained_N).tolist() == [0, 5]
    assert np.flatnonzero(attribution.predicted_N == "").tolist() == [0, 5]
    assert np.isfinite(attribution.scores_N_C).all()
    assert name in KINDS or not attribution.scores_N_C[[0, 5]].any()
