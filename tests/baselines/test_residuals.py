from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import KDTree

from baselines.residuals import FLOOR, Residuals
from gpca.explainers.registry import explainer_entry
from gpca.pairs.dataset import ragged
from gpca.pairs.perturbation import CONCEPTS
from gpca.uncertainty.spread import SMALLEST_RESIDUAL, log_residual

RIVALS = ("residuals_logistic", "residuals_forest")


@pytest.fixture(scope="module")
def attached(registrations):
    """With a covariance of two conditions, the first of which is wide for a poor pose."""
    n = len(registrations)
    random = np.random.default_rng(0)
    width_S_2 = 1e-4 * random.uniform(0.5, 2, size=(n, 2))
    width_S_2[registrations.concept == "pose", 0] *= 30
    numbers = random.uniform(size=(4, n, 2))
    arrays = dict(zip(("residual", "seconds", "icp_seconds", "icp_calls"), numbers, strict=True))
    arrays["icp_calls"] = np.column_stack([np.arange(n) + 50, np.full(n, 7)])
    return replace(registrations, attached=arrays | {"covariance": width_S_2[..., None, None] * np.eye(6)})


def fitted(name, registrations):
    explainer = explainer_entry(name).make("tiny", 0)
    explainer.fit(registrations.subset(registrations.rows("train")))
    return explainer


def with_clouds(registrations, clouds, targets):
    covariance = {"covariance": np.tile(1e-4 * np.eye(6), (len(clouds), 1, 1, 1))}
    return replace(registrations.subset(np.arange(len(clouds))), **ragged(clouds, targets), attached=covariance)


def test_a_residual_is_the_log_of_the_rms_distance_to_the_nearest_point():
    line = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    off = np.array([[0.0, 0.3, 0], [2, 0, 0.4]])
    to_line, to_off = KDTree(line), KDTree(off)
    assert log_residual(off, to_line) == pytest.approx(np.log(np.sqrt((0.3**2 + 0.4**2) / 2)))
    assert log_residual(line, to_off) == pytest.approx(np.log(np.sqrt((0.3**2 + 1 + 0.3**2 + 0.4**2) / 3)))
    assert log_residual(line, to_line) == np.log(SMALLEST_RESIDUAL)


def test_noise_is_seen_forwards_and_a_missing_part_backwards(registrations):
    random = np.random.default_rng(0)
    target = random.uniform(size=(600, 3)) * [1, 1, 0]
    same = random.uniform(size=(600, 3)) * [1, 1, 0]
    clouds = [same, same + 0.2 * random.normal(size=(600, 3)), same[same[:, 0] < 0.5]]
    (clean, noisy, cropped) = Residuals(None, FLOOR).features(with_clouds(registrations, clouds, [target] * 3))
    assert noisy[0] > clean[0] + 1
    assert cropped[1] > clean[1] + 1
    assert abs(cropped[0] - clean[0]) < 0.3


def test_the_third_feature_is_the_log_determinant_of_the_observed_condition_above_the_floor(attached):
    expected = 6 * np.log(attached.attached["covariance"][:, 0, 0, 0] + 1e-5)
    assert Residuals(None, 1e-5).features(attached)[:, 2] == pytest.approx(expected)


@pytest.mark.parametrize("name", RIVALS)
def test_they_name_the_concept_by_the_observed_condition_and_need_no_label_and_no_other_sample(name, attached):
    entry = explainer_entry(name)
    assert entry.reads == "uncertainty/removal" and entry.observed_only and not entry.oracle
    explainer = fitted(name, attached)
    attribution = explainer.explain(attached.without_labels())
    test = attached.rows("test")
    assert np.mean(attribution.predicted_N[test] == attached.concept[test]) > 0.8
    rows = np.array([7, 50, 3])
    assert explainer.explain(attached.subset(rows)).scores_N_C == pytest.approx(attribution.scores_N_C[rows], abs=1e-12)
    assert np.array_equal(attribution.icp_calls_N, attached.attached["icp_calls"][:, 0])
    assert np.array_equal(attribution.icp_seconds_N, attached.attached["icp_seconds"][:, 0])
    assert (attribution.seconds_N > attached.attached["seconds"][:, 0]).all()


@pytest.mark.parametrize("name", RIVALS)
def test_a_seed_repeats_every_byte_and_a_concept_absent_from_training_scores_0(name, attached):
    seen = attached.subset(np.flatnonzero(attached.concept != "noise"))
    first, again = (fitted(name, seen).explain(attached).scores_N_C for _ in range(2))
    assert np.array_equal(first, again)
    assert (first[:, CONCEPTS.index("noise")] == 0).all()
    assert first.sum(axis=1) == pytest.approx(1)
