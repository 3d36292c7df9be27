"""Bonnabel's rule, Brossard's form and Monte-Carlo, on shapes of which it is known what a start does."""

import numpy as np
import pytest

from gpca.uncertainty.estimators import analytic
from gpca.uncertainty.estimators.interface import FailedEstimate, RegisteredPair

from .cases import DEVIATION_6, plane, registered


def test_bonnabel_is_the_variance_over_the_hessian_of_planes_where_there_is_one():
    pair = registered("point_to_plane", noise=0.01)
    matches = pair.matches()
    rows = np.array([[*np.cross(y, n), *n] for y, n in zip(matches.source, matches.normals, strict=True)])
    distances = np.array([n @ (y - q) for y, q, n in zip(matches.source, matches.target, matches.normals, strict=True)])
    expected = distances @ distances / (len(rows) - 6) * np.linalg.inv(rows.T @ rows)
    assert analytic.bonnabel(pair) == pytest.approx(expected)
    for method in ("point_to_point", "point_to_point_open3d"):
        with pytest.raises(FailedEstimate, match=r"no covariance of point-to-point, as .*; register by point_to_plane"):
            analytic.bonnabel(registered(method))
    with pytest.raises(FailedEstimate, match="not of 'gicp'"):
        analytic.bonnabel(registered("gicp"))
    with pytest.raises(FailedEstimate, match="singular: 3 of 6 directions are open"):
        analytic.bonnabel(registered("point_to_plane", plane))


def test_unscented_and_monte_carlo_agree_where_the_pose_follows_the_start():
    """On a plane the two shifts along it and the turn within it stay as the start has them, and the rest is undone."""
    pair = registered("point_to_plane", plane)
    expected = np.diag(DEVIATION_6**2 * [0, 0, 1, 1, 1, 0])
    tolerance = 0.06 * np.sqrt(np.outer(DEVIATION_6, DEVIATION_6)).max() ** 2
    unscented, sampled = analytic.unscented(pair), analytic.monte_carlo(pair, 800)
    for found in (unscented, sampled):
        assert np.abs(found - expected).max() < 2 * tolerance
    assert np.diag(unscented)[2:5] == pytest.approx(np.diag(expected)[2:5], rel=0.12)
    assert np.diag(sampled)[2:5] == pytest.approx(np.diag(expected)[2:5], rel=0.2)


def test_unscented_is_exact_where_the_result_is_linear_in_the_start(monkeypatch):
    mixing = np.random.default_rng(0).normal(size=(6, 6))
    monkeypatch.setattr(RegisteredPair, "twists_from", lambda self, xi_n_6: xi_n_6 @ mixing.T)
    expected = mixing @ np.diag(DEVIATION_6**2) @ mixing.T
    assert analytic.unscented(registered()) == pytest.approx(expected)
    sampled = analytic.monte_carlo(registered(), 40_000)
    assert np.abs(sampled - expected).max() < 0.03 * np.abs(expected).max()


def test_the_sensor_adds_noise_and_a_bias():
    pair = registered("point_to_plane")
    base = analytic.unscented(pair)
    distances, rows = pair.matches().plane_rows()
    inverse = np.linalg.inv(rows.T @ rows)
    shift = inverse @ rows.sum(axis=0)
    expected = distances @ distances / (len(rows) - 6) * (inverse + np.outer(shift, shift))
    assert analytic.brossard(pair) - base == pytest.approx(expected, abs=1e-12)


def test_monte_carlo_is_of_the_pairs_own_draws():
    pair = registered(noise=0.02)
    assert (analytic.monte_carlo(pair, 20) == analytic.monte_carlo(pair, 20)).all()
    assert not (analytic.sample(pair, 20, "a") == analytic.sample(pair, 20, "b")).all()
    with pytest.raises(FailedEstimate, match="fewer than 7 runs"):
        analytic.monte_carlo(pair, 6)
