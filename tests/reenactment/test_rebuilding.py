import numpy as np
import pytest

from gpca.pairs.perturbation import NOISE, OVERLAP
from gpca.reenactment.enactment import NoiseScale, fresh_points, observe, rebuild
from gpca.reenactment.hypotheses import Hypothesis
from tests.reenactment.conftest import candidate_of


def rebuilt(candidate, model, *causes):
    random = np.random.default_rng(0)
    observed = candidate.observed(causes)
    inlier_N = np.where(np.abs(model.residuals(observed)[0]) < 0.2, 1.0, 0.0)
    hypothesis = Hypothesis(np.eye(4), inlier_N, 0.0, 0.02, 1.0, 0.0)
    return rebuild(np.eye(4), observe(observed, hypothesis, model, NoiseScale(model, random), random), model, random)


def test_what_was_observed_stays_as_it_is(drill, model):
    candidate = candidate_of(drill, "noise", "overlap")
    found = rebuilt(candidate, model, NOISE, OVERLAP)
    assert found.applied.tolist() == [True, True, True]  # a pose error may always be there
    assert np.array_equal(found.observed((NOISE, OVERLAP)), candidate.observed((NOISE, OVERLAP)))
    assert np.array_equal(found.model, model.points)


def test_without_noise_points_lie_nearer_to_the_surface(drill, model):
    candidate = candidate_of(drill, "noise")
    found = rebuilt(candidate, model, NOISE)
    noisy, clean = (np.abs(model.residuals(found.observed(causes))[0]) for causes in ((NOISE,), ()))
    assert np.sqrt((clean**2).mean()) < 0.4 * np.sqrt((noisy**2).mean())


def test_missing_surface_is_filled_as_densely_as_the_rest(drill, model):
    candidate = candidate_of(drill, "overlap")
    found = rebuilt(candidate, model, OVERLAP)
    assert len(found.clean) == pytest.approx(len(candidate.clean), rel=0.2)
    added = found.clean[len(candidate.kept) :]
    assert model.distances(added).max() < 2 * model.spacing
    lost = np.delete(candidate.clean, candidate.kept, axis=0)
    assert added.mean(axis=0) == pytest.approx(lost.mean(axis=0), abs=0.05)


def test_a_clean_cloud_is_not_touched(drill, model):
    random, observed = np.random.default_rng(0), drill[400:900]
    hypothesis = Hypothesis(np.eye(4), np.ones(500), 0.0, 0.02, 1.0, 0.0)
    quiet = observe(observed, hypothesis, model, NoiseScale(model, random), random)
    found = rebuild(np.eye(4), quiet, model, random)
    assert found.applied.tolist() == [False, True, False]
    assert np.array_equal(found.clean, observed) and np.array_equal(found.noisy, observed)


def test_fresh_points_lie_in_the_surface_around_their_rows(model):
    rows = np.arange(10)
    points = fresh_points(model, rows, 50, np.random.default_rng(0))
    nearest = np.linalg.norm(points[:, None] - model.points[rows], axis=2).min(axis=1)
    assert nearest.max() < 2 * model.spacing_M[rows].max()
