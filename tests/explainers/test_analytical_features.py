import numpy as np
import pytest
from scipy.spatial import cKDTree

from gpca.explainers.analytical_features import compare, local_shape

EVERY = np.arange(600)


def plane(seed):
    return np.random.default_rng(seed).uniform(-1, 1, size=(600, 3)) * [1, 1, 0]


def shape_at(cloud, point, neighbors):
    return [array[0] for array in local_shape(cKDTree(cloud), np.array([point]), neighbors)]


def test_a_line_is_linear_a_disc_planar_and_a_ball_neither():
    t = np.linspace(-1, 1, 21)
    circle = np.column_stack([np.cos(np.pi * t[:-1]), np.sin(np.pi * t[:-1])])
    normal, planarity, linearity = shape_at(np.outer(t, [1, 2, 2]), [0, 0, 0], 21)
    assert (planarity, linearity) == (pytest.approx(0), pytest.approx(1))
    assert normal @ [1, 2, 2] == pytest.approx(0)
    normal, planarity, linearity = shape_at(
        np.column_stack([circle[:, 0], np.full(20, 3), circle[:, 1]]), [0, 3, 0], 20
    )
    assert (planarity, linearity) == (pytest.approx(1), pytest.approx(0))
    assert np.abs(normal) == pytest.approx([0, 1, 0])
    octahedron = np.vstack([np.eye(3), -np.eye(3)])
    assert shape_at(octahedron, [0, 0, 0], 6)[1:] == [pytest.approx(0), pytest.approx(0)]


def test_a_shape_has_the_eigenvalue_ratios_of_its_points_and_is_finite_for_coinciding_or_few():
    points = np.vstack([np.diag([3.0, 2.0, 1.0]), -np.diag([3.0, 2.0, 1.0])])
    normal, planarity, linearity = shape_at(points, [0, 0, 0], 6)
    assert (planarity, linearity) == (pytest.approx((4 - 1) / 9), pytest.approx((9 - 4) / 9))
    assert np.abs(normal) == pytest.approx([0, 0, 1])
    assert shape_at(np.zeros((20, 3)), [0, 0, 0], 16)[1:] == [0, 0]
    assert np.isfinite(shape_at(np.eye(3), [0, 0, 0], 16)[1])


def test_what_each_feature_sees():
    target, source = plane(0), plane(1)
    noisy = source + 0.1 * np.random.default_rng(2).normal(size=(600, 3))
    tilted = source @ np.array([[0.6, 0, 0.8], [0, 1, 0], [-0.8, 0, 0.6]])
    clean_row, noisy_row, tilted_row = (np.array(compare(c, target, EVERY, 16)) for c in (source, noisy, tilted))
    assert clean_row[0] == pytest.approx(1)
    assert clean_row[1] + clean_row[2] == pytest.approx(1)  # in a plane the third eigenvalue is 0
    assert np.abs(clean_row[3:5]).max() < 0.05
    assert tilted_row[0] == pytest.approx(0.6)
    assert tilted_row[1:3] == pytest.approx(clean_row[1:3])
    assert noisy_row[3] < -0.2
