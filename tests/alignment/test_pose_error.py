import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gpca.alignment.pose_error import PoseErrors, adds_error, displacements, pose_error
from gpca.rigid import transform


def pose(angle_deg=0.0, axis="z", shift=(0.0, 0.0, 0.0)):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler(axis, angle_deg, degrees=True).as_matrix()
    T[:3, 3] = shift
    return T


@pytest.fixture
def square():
    return np.array([[1.0, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])


def add_error(points, T_estimated, T_true):
    return pose_error(points, T_estimated, T_true, symmetric=False)


def test_add_of_a_shift_is_its_length_and_adds_counts_each_point_to_the_nearest_of_the_truth(square):
    assert add_error(square, pose(shift=(3.0, 0, 4.0)), pose()) == pytest.approx(5.0)
    assert add_error(square, pose(90), pose()) == pytest.approx(2.0)
    assert adds_error(square, pose(90), pose()) == pytest.approx(0.0, abs=1e-12)
    assert pose_error(square, pose(90), pose(), symmetric=True) < 1e-12
    points = np.array([[0.0, 0, 0], [10, 0, 0]])
    assert adds_error(points, pose(shift=(1.0, 0, 0)), pose()) == pytest.approx(1.0)
    assert adds_error(points, pose(shift=(9.0, 0, 0)), pose()) == pytest.approx((1 + 9) / 2)


def test_errors_of_many_poses_are_those_of_each_wherever_the_camera_is(square):
    camera = pose(37, "y", (0.3, -0.2, 0.9))
    errors = [add_error(square, camera @ pose(20), camera @ pose(5)), add_error(square, pose(20), pose(5))]
    assert errors[0] == pytest.approx(errors[1])
    poses = np.stack([pose(20), pose(0, shift=(0.1, 0.2, 0.0)), pose(90)])
    errors = PoseErrors(square, 3, symmetric=False)(poses)
    assert errors == pytest.approx([add_error(square[:3], T, pose()) for T in poses])
    errors = PoseErrors(square, 2, symmetric=True)(np.stack([pose(90), pose(180)]))
    assert errors == pytest.approx([0, 0], abs=1e-12)


def test_a_displacement_is_the_rms_distance_that_points_are_moved():
    points = np.random.default_rng(0).normal(size=(50, 3))
    T = pose(37, "y", (0.1, 0.2, -0.3))
    expected = np.sqrt(np.square(transform(T, points) - points).sum(axis=1).mean())
    assert displacements(np.array([np.eye(4), T]), points) == pytest.approx([0, expected])
