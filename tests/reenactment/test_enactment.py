from dataclasses import replace

import numpy as np
import pytest

from gpca.causes.candidate import Counterfactuals, Registrar
from gpca.causes.dataset import LABELS
from gpca.causes.truth import ALL, NONE
from gpca.pairs.perturbation import NOISE, OVERLAP
from gpca.reenactment.dataset import row_of, verdict
from gpca.reenactment.enactment import NoiseScale, completed, fresh_points, observe, rebuild, reenact
from gpca.reenactment.hypotheses import Hypothesis
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from tests.reenactment.conftest import TRUTH, candidate_of, pair_of


def hypothesis(inlier_N):
    return Hypothesis(np.eye(4), inlier_N, 0.0, 0.02, 1.0, 0.0, np.zeros(len(inlier_N)))


@pytest.fixture(scope="module")
def scale(model):
    return NoiseScale(model, np.random.default_rng(0))


def observed(drill, noise, count=500, seed=1):
    return drill[400 : 400 + count] + noise * np.random.default_rng(seed).normal(size=(count, 3))


@pytest.mark.parametrize("noise", [0.0, 0.003, 0.01, 0.02, 0.04, 0.06, 0.08])
def test_noise_is_found_within_a_fifth(drill, model, scale, noise):
    points = observed(drill, noise)
    found = observe(points, hypothesis(np.ones(len(points))), model, scale, np.random.default_rng(0))
    assert found.noise == pytest.approx(noise, rel=0.2, abs=0.004)
    assert found.outliers == 0 and found.covered.all()


def test_outliers_count_neither_as_noise_nor_as_surface_even_where_nearly_all_are(drill, model, scale):
    points = observed(drill, 0.01)
    inlier_N = np.ones(len(points))
    points[:25], inlier_N[:25] = np.random.default_rng(2).uniform(-0.5, 0.5, size=(25, 3)), 0.1
    found = observe(points, hypothesis(inlier_N), model, scale, np.random.default_rng(0))
    assert found.noise == pytest.approx(0.01, abs=0.004)
    assert found.outliers == pytest.approx(0.05)
    points = observed(drill, 0.01, count=40)
    inlier_N = np.linspace(0.4, 0.0, 40)
    found = observe(points, hypothesis(inlier_N), model, scale, np.random.default_rng(0))
    assert np.array_equal(found.is_outlier, np.arange(40) >= 20)


def rebuilt(candidate, model, *causes):
    random = np.random.default_rng(0)
    observed = candidate.observed(causes)
    inlier_N = np.where(np.abs(model.residuals(observed)[0]) < 0.2, 1.0, 0.0)
    return rebuilt_from(observed, inlier_N, model, random)


def rebuilt_from(observed, inlier_N, model, random):
    found = observe(observed, hypothesis(inlier_N), model, NoiseScale(model, random), random)
    return rebuild(np.eye(4), found, model, random)


def test_what_was_observed_stays_points_without_noise_lie_nearer_and_missing_surface_is_filled(drill, model):
    candidate = candidate_of(drill, "noise", "overlap")
    found = rebuilt(candidate, model, NOISE, OVERLAP)
    assert found.applied.tolist() == [True, True, True]  # a pose error may always be there
    assert np.array_equal(found.observed((NOISE, OVERLAP)), candidate.observed((NOISE, OVERLAP)))
    assert np.array_equal(found.model, model.points)
    candidate = candidate_of(drill, "noise")
    found = rebuilt(candidate, model, NOISE)
    noisy, clean = (np.abs(model.residuals(found.observed(causes))[0]) for causes in ((NOISE,), ()))
    assert np.sqrt((clean**2).mean()) < 0.4 * np.sqrt((noisy**2).mean())
    candidate = candidate_of(drill, "overlap")
    found = rebuilt(candidate, model, OVERLAP)
    assert len(found.clean) == pytest.approx(len(candidate.clean), rel=0.2)
    added = found.clean[len(candidate.kept) :]
    assert model.distances(added).max() < 2 * model.spacing
    lost = np.delete(candidate.clean, candidate.kept, axis=0)
    assert added.mean(axis=0) == pytest.approx(lost.mean(axis=0), abs=0.05)


def test_fresh_points_lie_in_the_surface_around_their_rows(model):
    rows = np.arange(10)
    points = fresh_points(model, rows, 50, np.random.default_rng(0))
    nearest = np.linalg.norm(points[:, None] - model.points[rows], axis=2).min(axis=1)
    assert nearest.max() < 2 * model.spacing_M[rows].max()


SETTINGS = ReenactmentSettings()


def verdict_of(enactments, pair):
    arrays = row_of(enactments, pair, SETTINGS, TRUTH)
    return verdict(arrays["error"][None], arrays["weight"][None], TRUTH.limits)[0]


@pytest.mark.parametrize(("cause", "seed"), [("nominal", 100), ("noise", 100), ("pose", 100), ("overlap", 100)])
def test_a_clean_pair_is_nominal_and_each_strong_cause_is_named(drill, cause, seed):
    candidate = candidate_of(drill, cause, seed=seed)  # nominal is no cause
    pair, _ = pair_of(candidate)
    scores_4 = verdict_of(reenact(pair, SETTINGS, TRUTH), pair)
    assert LABELS[scores_4.argmax()] == cause
    assert scores_4.sum() == pytest.approx(1) and (scores_4 >= 0).all()


def test_what_is_enacted_is_near_the_truth_and_adds_up(drill):
    candidate = candidate_of(drill, "noise", "overlap", seed=104)
    pair, _ = pair_of(candidate)
    enacted = reenact(pair, SETTINGS, TRUTH)[0]
    assert enacted.phi_3.sum() == pytest.approx(enacted.error_8[ALL] - enacted.error_8[NONE])
    surface = ModelSurface(drill[:2000])
    xi = np.random.default_rng(5).normal(size=(13, 6)) * TRUTH.deviation_6()
    measured = Counterfactuals(Registrar(candidate, TRUTH), surface.errors, xi, TRUTH)
    true = np.array([measured.error(subset) for subset in range(8)])
    assert np.corrcoef(enacted.error_8, true)[0, 1] > 0.8
    assert (enacted.uncertainty_8 >= 0).all() and enacted.uncertainty_8[NONE] == 0


def test_what_finds_no_partner_is_as_wrong_as_can_be(drill):
    pair, _ = pair_of(candidate_of(drill))
    far = pair.T_init.copy()
    far[:3, 3] += 5
    enacted = reenact(replace(pair, T_init=far), SETTINGS, TRUTH)[0]
    assert enacted.error_8[ALL] == 0.5
    assert enacted.error_8[NONE] < 0.1


def test_a_symmetric_model_stays_one_beside_a_table(can):
    model, random = ModelSurface(can[:400]), np.random.default_rng(0)
    table = np.column_stack([random.uniform(0.1, 0.9, size=(120, 2)), np.full(120, can[:, 2].min())])
    on_table = np.arange(520) >= 400
    beside = Hypothesis(np.eye(4), np.ones(520), 0.0, 0.02, 1.0, 0.0, on_table.astype(float))
    observation = observe(np.concatenate([can[400:800], table]), beside, model, NoiseScale(model, random), random)
    assert observation.is_lone.mean() > 0.1 and model.symmetric
    assert completed(model, observation) is model
    assert not model.completed(observation.points[observation.is_lone], 0.0).symmetric
