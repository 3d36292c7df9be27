"""SHAP and sensitivity analysis: the protocol's own reading is what the explainers say."""

import numpy as np
import pytest

from baselines.sensitivity import local_derivatives
from baselines.shap_kl import shapley_values
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.steps.readings import knobs
from gpca.uncertainty.designs import design_rows, evaluate_design
from tests.steps.readings.conftest import rows_of


@pytest.fixture(scope="module")
def outcomes(run_files):
    registrations = Registrations.load(run_files.registrations["tiny", 0])
    chosen = registrations.subset(design_rows(registrations, "additive", 6))
    return chosen.concept, evaluate_design("additive", chosen, "tiny", 0, run_files.uncertainty())[0].uncertainty


def accuracy(concept_S, values_S_3):
    return np.mean((np.array(CONCEPTS)[values_S_3.argmax(axis=1)] == concept_S) & (np.ptp(values_S_3, axis=1) > 0))


def test_the_protocols_readings_are_what_the_explainers_say(run_files, outcomes):
    concept_S, uncertainty_S_K = outcomes
    sa = {"quantity": ["divergence"], "sign": ["signed", "lowest"], "unit": ["range"], "step": ["small"]}
    found = rows_of(knobs.sensitivity, run_files, sa)
    expected = {
        sign: accuracy(concept_S, factor * local_derivatives(uncertainty_S_K))
        for sign, factor in (("signed", 1), ("lowest", -1))
    }
    for sign, value in expected.items():
        assert found[("divergence", sign, "range", "small"), "sa_local_additive", "accuracy", "all"] == value
    shap = {
        "starts": [5, 13], "background": ["observed", "clean"], "quantity": ["divergence"], "floor": [1e-4],
        "sign": ["signed"],
    }  # fmt: skip
    found = rows_of(knobs.shap, run_files, shap)
    of_protocol = found[(13, "observed", "divergence", 1e-4, "signed"), "shap_additive", "accuracy", "all"]
    assert of_protocol == accuracy(concept_S, shapley_values(uncertainty_S_K[:, :8]))
    assert len(found) == 4


def test_knobs_that_are_turned_as_far_as_the_protocols_say_what_shap_says(run_files, outcomes):
    concept_S, uncertainty_S_K = outcomes
    choices = {"noise": [0.02, 0.03], "spread": [3.75], "overlap": [0.4, 0.6]}
    found = rows_of(knobs.magnitudes, run_files, choices)
    assert found[(0.02, 3.75, 0.4), "shap_additive", "accuracy", "all"] == accuracy(
        concept_S, shapley_values(uncertainty_S_K[:, :8])
    )
    assert {(reading, method) for reading, method, _, _ in found} == {
        ((noise, 3.75, overlap), method)
        for noise in (0.02, 0.03)
        for overlap in (0.4, 0.6)
        for method in ("shap_additive", "sa_local_additive")
    }


def test_every_quantity_is_measured_in_every_condition(run_files):
    quantities = ["divergence", "divergence_reversed", "log_determinant", "trace", "residual", "inlier_rmse",
                  "inlier_rmse_of_one"]  # fmt: skip
    settings = run_files.uncertainty()
    [(_, _, pairs)] = knobs._pairs(run_files, 13, "test")
    measured = knobs._steps(next(pairs)[1]["observed"], settings)
    assert set(measured) == set(quantities)
    for values_K in measured.values():
        assert values_K.shape == (7,)
        assert np.isfinite(values_K).all()
    assert max(measured["divergence"][0], measured["divergence_reversed"][0]) < 1e-12
