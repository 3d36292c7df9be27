"""SGLD and SVGD on a Gaussian whose covariance is known, and the slope that they follow."""

import numpy as np
import pytest

from gpca.rigid import exp, transform
from gpca.uncertainty.estimators import posterior
from gpca.uncertainty.estimators.posterior import Posterior

from .cases import DEVIATION_6, registered

FACTOR = np.random.default_rng(3).normal(size=(6, 6))
COVARIANCE = 1e-3 * (FACTOR @ FACTOR.T + np.eye(6))
MEAN = np.linspace(-0.05, 0.05, 6)


def slope(x_n_6):
    return -np.linalg.solve(COVARIANCE, (x_n_6 - MEAN).T).T


def whitened(covariance):
    """The covariance in axes in which the right one is the identity."""
    root = np.linalg.inv(np.linalg.cholesky(COVARIANCE))
    return root @ covariance @ root.T


def test_langevin_and_stein_spread_as_the_gaussian_that_they_visit():
    random = np.random.default_rng(0)
    visited = posterior.langevin(slope, np.zeros((400, 6)), COVARIANCE, 500, 100, 0.1, random)
    assert (np.abs(visited.mean(axis=0) - MEAN) / np.sqrt(np.diag(COVARIANCE))).max() < 0.12
    # The steps make it larger by 1 / (1 - ε/4).
    assert whitened(np.cov(visited, rowvar=False)) == pytest.approx(np.eye(6) / (1 - 0.1 / 4), abs=0.06)
    # A hundred particles in six dimensions are known to spread too little; the shape is right.
    start = np.random.default_rng(0).normal(size=(100, 6)) * 0.2
    ended = posterior.descend(slope, start, 600, 0.02)
    assert (np.abs(ended.mean(axis=0) - MEAN) / np.sqrt(np.diag(COVARIANCE))).max() < 0.15
    values = np.linalg.eigvalsh(whitened(np.cov(ended, rowvar=False)))
    assert values.min() > 0.5 and values.max() < 1.2
    assert np.sqrt(values.mean()) == pytest.approx(0.9, abs=0.15)


def test_the_slope_is_that_of_the_density():
    """Against differences of prior and likelihood, with the matches that the pose has."""
    pair = registered(noise=0.02)
    posterior = Posterior(pair)
    xi = np.array([0.02, -0.01, 0.015, 0.01, -0.005, 0.01])
    distance, rows = pair.pair.target_tree.query(transform(exp(xi[None])[0], pair.pair.source))
    near = distance < 0.1

    def density(step):
        moved = transform(exp(step[None])[0] @ exp(xi[None])[0], pair.pair.source)
        squares = np.square(moved - pair.pair.target[rows])[near].sum()
        return -0.5 * squares / pair.matches().variance - 0.5 * np.square((xi + step) / DEVIATION_6).sum()

    found = [(density(1e-5 * axis) - density(-1e-5 * axis)) / 2e-5 for axis in np.eye(6)]
    assert posterior.slope(xi[None])[0] == pytest.approx(found, rel=1e-4, abs=0.05)


def test_a_part_of_the_points_counts_for_all():
    posterior = Posterior(registered(noise=0.02))
    batches = [np.arange(200)[i::4] for i in range(4)]
    mean = np.mean([posterior.slope(np.full((1, 6), 0.01), rows) for rows in batches], axis=0)
    assert mean == pytest.approx(posterior.slope(np.full((1, 6), 0.01)), rel=1e-9)


@pytest.mark.parametrize("estimate", [posterior.bayesian_icp, posterior.stein_icp])
def test_on_a_pair_both_are_surer_than_the_starts_and_repeat_themselves(estimate):
    pair = registered(noise=0.01)
    found = estimate(pair, steps=40)
    assert (np.linalg.eigvalsh(found) > 0).all()
    assert (np.diag(found) < DEVIATION_6**2).all()
    assert (found == estimate(pair, steps=40)).all()
