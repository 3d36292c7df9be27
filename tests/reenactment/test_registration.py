"""Registration by the search of the re-enactment, and by ICP from its starts."""

import numpy as np
import pytest

from gpca.alignment.methods.interface import Pair
from gpca.alignment.methods.registry import make_method
from gpca.alignment.pose_error import pose_error
from gpca.reenactment.registration import pose_posterior
from gpca.reenactment.settings import ReenactmentSettings
from gpca.rigid import exp, inverse, rotation_angle_rad, scale_translation, transform


@pytest.fixture(scope="module")
def turned():
    """A bent sheet without symmetries, turned by 135° and moved, of which a tenth is missing, and the true pose."""
    random = np.random.default_rng(4)
    u, v = random.uniform(size=(2, 1200))
    sheet = np.column_stack([0.7 * u, 0.4 * v * (1 + 0.4 * u), 0.35 * u**3 + 0.15 * np.sin(4 * v)])
    sheet -= sheet.mean(axis=0)
    target, source = sheet[:500], sheet[600:]
    T_true = exp(np.array([[1.6, -1.4, 1.0, 0.1, -0.05, 0.08]]))[0]
    seen = source[source[:, 0] < 0.28]
    moved = transform(inverse(T_true), seen + random.normal(scale=0.008, size=seen.shape))
    return Pair(moved, target, seed=1), T_true


@pytest.mark.parametrize("name", ["posterior", "posterior_global", "multistart", "multistart_likelihood"])
def test_many_starts_reach_what_one_does_not(turned, name):
    pair, T_true = turned
    many, one = (make_method(each)(pair) for each in (name, "point_to_point"))
    errors = [pose_error(pair.source, outcome.T_target_source, T_true, False) for outcome in (many, one)]
    assert many.converged and errors[0] < 0.1 < errors[1]


@pytest.mark.parametrize("prior", [True, False])
def test_the_poses_move_with_the_target_and_scale_with_the_unit(turned, prior):
    pair, _ = turned
    poses_K, weight_K = pose_posterior(pair, ReenactmentSettings(), prior)
    assert weight_K.sum() == pytest.approx(1) and (np.diff(weight_K) <= 0).all()
    away = np.eye(4)
    away[:3, 3] = [20, -10, 5]
    start = scale_translation(away @ pair.T_target_source_init, 3)
    other = Pair(3 * pair.source, 3 * transform(away, pair.target), start, seed=pair.seed)
    others_K, other_weight_K = pose_posterior(other, ReenactmentSettings(), prior, unit=3)
    assert other_weight_K == pytest.approx(weight_K, abs=1e-3)
    back = scale_translation(inverse(away) @ scale_translation(others_K[0], 1 / 3), 1)
    np.testing.assert_allclose(back, poses_K[0], atol=1e-3)


def test_of_poses_that_fit_alike_the_nearest_to_the_start_is_the_likeliest():
    """Half turns of an ellipsoid fit alike, and ICP from many starts takes any."""
    points = np.random.default_rng(0).normal(size=(600, 3))
    points *= np.array([0.5, 0.3, 0.2]) / np.linalg.norm(points, axis=1, keepdims=True)
    for turn in np.eye(3):
        T_start = exp(np.array([[*(0.3 * turn), 0.02, 0.01, -0.02]]))[0]
        pair = Pair(transform(inverse(T_start), points[:300]), points[300:])
        poses_K, _ = pose_posterior(pair, ReenactmentSettings())
        assert rotation_angle_rad(poses_K[0]) < 0.6
