import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from gpca.alignment.least_squares import best_motion, best_rotation, plane_step
from gpca.alignment.rigid import rotate, transform
from gpca.alignment.twist import exp, log

RANDOM = np.random.default_rng(0)
SOURCE = RANDOM.normal(size=(30, 3))
MOTION = exp(RANDOM.normal(size=(1, 6)))[0]
NOISY = transform(MOTION, SOURCE) + RANDOM.normal(scale=0.1, size=(30, 3))
WEIGHTS = RANDOM.uniform(size=30)


def test_a_rotation_is_scipys():
    expected, _ = Rotation.align_vectors(NOISY, SOURCE, weights=WEIGHTS)
    np.testing.assert_allclose(best_rotation(SOURCE, NOISY, WEIGHTS), expected.as_matrix(), atol=1e-12)


def test_a_motion_is_the_minimum_of_the_weighted_squares():
    def residuals(xi_6):
        return (np.sqrt(WEIGHTS)[:, None] * (NOISY - transform(exp(xi_6[None])[0], SOURCE))).ravel()

    found = least_squares(residuals, log(MOTION[None])[0], xtol=1e-15, ftol=1e-15, gtol=1e-15)
    np.testing.assert_allclose(best_motion(SOURCE, NOISY, WEIGHTS), exp(found.x[None])[0], atol=1e-6)


@pytest.mark.parametrize("flat", [[1, 1, 0], [1, 0, 0], [0, 0, 0]])
def test_a_flat_cloud_gives_a_rotation_and_no_mirror(flat):
    T = best_motion(SOURCE * flat, -SOURCE * flat, np.ones(30))
    np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-9)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1)


def test_a_reflection_is_none():
    R = best_rotation(SOURCE, SOURCE * [1, 1, -1], np.ones(30))
    assert np.linalg.det(R) == pytest.approx(1)


def test_steps_to_planes_reach_a_known_motion():
    normals = RANDOM.normal(size=(30, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    motion = exp(np.array([[0.1, -0.2, 0.1, 0.3, 0.1, -0.2]]))[0]
    target = transform(motion, SOURCE)
    target += np.cross(normals, RANDOM.normal(size=(30, 3)))  # anywhere on the plane
    T = np.eye(4)
    for _ in range(20):
        T = plane_step(transform(T, SOURCE), target, normals, WEIGHTS) @ T
    np.testing.assert_allclose(T, motion, atol=1e-9)


def test_what_one_plane_leaves_open_does_not_move():
    points = SOURCE * [1, 1, 0]
    T = plane_step(points, points + np.array([0.7, -0.4, 0.1]), np.tile([0.0, 0.0, 1.0], (30, 1)), np.ones(30))
    np.testing.assert_allclose(T[:3, 3], [0, 0, 0.1], atol=1e-9)
    np.testing.assert_allclose(rotate(T, np.array([0.0, 0.0, 1.0])), [0, 0, 1], atol=1e-9)
