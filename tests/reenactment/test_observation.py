import numpy as np
import pytest

from gpca.reenactment.enactment import NoiseScale, observe
from gpca.reenactment.hypotheses import Hypothesis


def hypothesis(inlier_N):
    return Hypothesis(np.eye(4), inlier_N, 0.0, 0.02, 1.0, 0.0)


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
    assert (found.outliers, found.missing) == (0, 0)


def test_outliers_neither_count_as_noise_nor_as_surface(drill, model, scale):
    points = observed(drill, 0.01)
    inlier_N = np.ones(len(points))
    points[:25], inlier_N[:25] = np.random.default_rng(2).uniform(-0.5, 0.5, size=(25, 3)), 0.1
    found = observe(points, hypothesis(inlier_N), model, scale, np.random.default_rng(0))
    assert found.noise == pytest.approx(0.01, abs=0.004)
    assert found.outliers == pytest.approx(0.05)


def test_where_nearly_all_are_outliers_the_likelier_half_counts(drill, model, scale):
    points = observed(drill, 0.01, count=40)
    inlier_N = np.linspace(0.4, 0.0, 40)
    found = observe(points, hypothesis(inlier_N), model, scale, np.random.default_rng(0))
    assert np.array_equal(found.is_outlier, np.arange(40) >= 20)
