"""Point-to-plane from many starts against Open3D from each."""

import numpy as np
import pytest

from gpca.alignment.batched_plane_icp import BatchedPlaneICP
from gpca.alignment.icp import ICP, ICPSettings
from gpca.alignment.twist import exp

SETTINGS = ICPSettings("point_to_plane")


def ellipsoid(seed, points=300):
    directions = np.random.default_rng(seed).normal(size=(points, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    normals = directions / [0.5, 0.35, 0.2]
    return directions * [0.5, 0.35, 0.2], normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_it_ends_where_open3d_ends():
    (target, normals), (source, _) = ellipsoid(0), ellipsoid(1, 250)
    starts_n = exp(np.random.default_rng(2).normal(size=(20, 6)) * 0.08)
    poses_n, fitness_n, rmse_n = BatchedPlaneICP(target, normals, SETTINGS).register(source, starts_n)
    icp = ICP(target, normals, SETTINGS)
    for start, pose, fitness, rmse in zip(starts_n, poses_n, fitness_n, rmse_n, strict=True):
        theirs = icp.register(source, start)
        assert np.abs(pose - theirs.T_target_source).max() < 1e-6
        assert (fitness, rmse) == pytest.approx((theirs.fitness, theirs.inlier_rmse), abs=1e-6)


def test_what_planes_leave_open_stays():
    plane = np.column_stack([np.random.default_rng(0).uniform(-0.5, 0.5, size=(200, 2)), np.zeros(200)])
    start = exp(np.array([[0.05, -0.04, 0.0, 0.01, 0.02, 0.03]]))
    up = np.tile([0.0, 0.0, 1.0], (200, 1))
    poses_1, _, _ = BatchedPlaneICP(plane, up, SETTINGS).register(plane, start)
    assert np.abs((plane @ poses_1[0, :3, :3].T + poses_1[0, :3, 3])[:, 2]).max() < 1e-6  # down on the plane
    assert poses_1[0, :2, 3] == pytest.approx(start[0, :2, 3], abs=5e-3)  # and not moved along it


def test_without_correspondences_a_start_stays_where_it_is():
    target, normals = ellipsoid(0)
    far = exp(np.array([[0, 0, 0, 5.0, 0, 0], np.zeros(6)]))
    poses_2, fitness_2, rmse_2 = BatchedPlaneICP(target, normals, SETTINGS).register(target, far)
    assert (poses_2[0] == far[0]).all()
    assert fitness_2.tolist() == [0, 1]
    assert (rmse_2 < 1e-6).all()
