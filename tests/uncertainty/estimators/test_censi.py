"""Censi's closed form against finite differences of what it is made of, and of the minimum itself."""

import numpy as np
import pytest

from gpca.rigid import best_motion, exp, log, transform
from gpca.uncertainty.estimators.analytic import censi, hessian, mixed_derivatives
from gpca.uncertainty.estimators.interface import Correspondences, FailedEstimate

from .cases import plane, registered

STEP = 1e-4


@pytest.fixture
def matches():
    """Twelve matched points at the pose of least squares, with residuals that are no rounding."""
    random = np.random.default_rng(0)
    target = random.normal(size=(12, 3)) * [0.5, 0.3, 0.2]
    source = target + 0.05 * random.normal(size=target.shape)
    return Correspondences(transform(best_motion(source, target, np.ones(12)), source), target, None)


def cost(xi_6, source, target):
    return float(np.square(transform(exp(xi_6[None])[0], source) - target).sum())


def test_the_hessian(matches):
    def difference(i, j):
        """∂²A/∂ξ_i ∂ξ_j at zero."""
        a, b = STEP * np.eye(6)[i], STEP * np.eye(6)[j]
        costs = [cost(sign * xi, matches.source, matches.target) for xi in (a + b, a - b) for sign in (1, -1)]
        return np.dot(costs, (1, 1, -1, -1)) / (4 * STEP**2)

    found = [[difference(i, j) for j in range(6)] for i in range(6)]
    np.testing.assert_allclose(hessian(matches), found, atol=1e-5)


def test_the_mixed_derivatives(matches):
    """By one coordinate of one point of either cloud, and one of the twist."""
    for which, derivatives_n_6_3 in enumerate(mixed_derivatives(matches)):
        for point, axis, k in ((0, 0, 0), (3, 1, 2), (5, 2, 4), (7, 0, 5), (9, 1, 3)):

            def gradient(step, which=which, point=point, axis=axis, k=k):
                clouds = [matches.source.copy(), matches.target.copy()]
                clouds[which][point, axis] += step
                forward, backward = (cost(sign * STEP * np.eye(6)[k], *clouds) for sign in (1, -1))
                return (forward - backward) / (2 * STEP)

            found = (gradient(STEP) - gradient(-STEP)) / (2 * STEP)
            assert derivatives_n_6_3[point, k, axis] == pytest.approx(found, abs=1e-5)


def test_the_covariance_is_that_of_the_minimum_under_noise_of_the_points(matches):
    """The definition: registered again and again with new noise, the matches kept."""
    sigma, random = 1e-3, np.random.default_rng(1)
    runs = []
    for _ in range(1500):
        source, target = (cloud + sigma * random.normal(size=cloud.shape) for cloud in (matches.source, matches.target))
        runs.append(log(best_motion(source, target, np.ones(12))[None])[0])
    inverse = np.linalg.inv(hessian(matches))
    middle = sum(np.einsum("nij,nkj->ik", part, part) for part in mixed_derivatives(matches))
    expected, found = sigma**2 * inverse @ middle @ inverse, np.cov(np.array(runs), rowvar=False)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.abs((found - expected) / scale).max() < 0.15


def test_the_noise_is_estimated_from_the_residuals():
    matches = registered(noise=0.01).matches()
    inverse = np.linalg.inv(hessian(matches))
    middle = sum(np.einsum("nij,nkj->ik", part, part) for part in mixed_derivatives(matches))
    variance = np.square(matches.residuals).sum() / (matches.residuals.size - 6) / 2
    assert censi(registered(noise=0.01)) == pytest.approx(variance * inverse @ middle @ inverse)


def test_a_hessian_that_leaves_a_turn_open_is_named_and_another_method_refused():
    """All points on one line: turning about it moves nothing."""

    def line(seed):
        along = np.sort(np.random.default_rng(seed).uniform(-0.5, 0.5, 200))
        return np.outer(along, [1.0, 0, 0]), np.tile([0.0, 0, 1], (200, 1))

    with pytest.raises(FailedEstimate, match="Hessian is singular: 1 of 6 directions"):
        censi(registered(shape=line))
    assert np.isfinite(censi(registered(shape=plane))).all()  # between points a plane holds all six
    with pytest.raises(FailedEstimate, match="that of point-to-point, not of 'gicp'"):
        censi(registered("gicp"))
