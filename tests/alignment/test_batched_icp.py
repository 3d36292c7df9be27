from typing import get_args

import numpy as np
import pytest
from scipy.spatial import cKDTree

from gpca.alignment import batched_icp
from gpca.alignment.batched_icp import BatchedICP, BatchedPlaneICP, icp_to
from gpca.alignment.features import estimate_normals
from gpca.alignment.icp import ICP, ICPSettings, Method
from gpca.errors import InputError
from gpca.pairs.perturbation import CONCEPTS, PERTURBATIONS, Severities
from gpca.rigid import exp
from tests.uncertainty.estimators.cases import ellipsoid

from .methods import pairs

DEVIATION = np.array([0.1, 0.1, 0.1, 0.03, 0.03, 0.03])
TO_PLANES = ICPSettings("point_to_plane")


def starts(n, seed=0, spread=1.0):
    return exp(np.random.default_rng(seed).normal(size=(n, 6)) * DEVIATION * spread)


def clouds(objects, index):
    """Disjoint points of one object, relative to its diameter: source, target and the target's normals."""
    source, target, _, normals = pairs.clouds(objects, index)
    return source, target, normals


def by_open3d(source, target, normals, settings, poses_n):
    icp = ICP(target, normals, settings)
    runs = [icp.register(source, pose) for pose in poses_n]
    return [np.array([getattr(run, name) for run in runs]) for name in ("T_target_source", "fitness", "inlier_rmse")]


def assert_same(ours, theirs, atol=1e-9):
    for one, other in zip(ours, theirs, strict=True):
        assert one.shape == other.shape
        assert np.abs(one - other).max() <= atol


@pytest.mark.parametrize("index", range(3))
@pytest.mark.parametrize("concept", CONCEPTS)
def test_many_runs_end_where_open3d_ends(objects, concept, index):
    source, target, _ = clouds(objects, index)
    source = PERTURBATIONS[concept](source, Severities(), np.random.default_rng(index)).points
    poses_n = starts(13, index, spread=2.0)
    result = BatchedICP(target, ICPSettings()).register(source, poses_n)
    assert_same(result, by_open3d(source, target, None, ICPSettings(), poses_n))
    assert np.abs(result[0] - poses_n).max() > 0.01  # they did move
    assert np.isin(result[1] * len(source), np.arange(len(source) + 1)).all()


def test_iterations_and_distance_count_as_in_open3d(objects):
    source, target, _ = clouds(objects, 1)
    few = (ICPSettings(max_iterations=most) for most in (1, 3))
    for settings in (*few, *(ICPSettings(correspondence_distance=distance) for distance in (0.02, 0.5, 5.0))):
        result = BatchedICP(target, settings).register(source, starts(8))
        assert_same(result, by_open3d(source, target, None, settings, starts(8)))


def test_another_unit_of_length_makes_the_same_steps_as_open3d(objects):
    """Not those of the smaller unit: Open3D's limit on the change of the RMSE is a length."""
    source, target, _ = clouds(objects, 0)
    poses_n = starts(5)
    poses_n[:, :3, 3] *= 1000
    settings = ICPSettings(correspondence_distance=100.0)
    T_n, fitness_n, rmse_n = BatchedICP(1000 * target, settings).register(1000 * source, poses_n)
    assert_same((T_n, fitness_n, rmse_n), by_open3d(1000 * source, 1000 * target, None, settings, poses_n), atol=1e-6)
    assert (fitness_n > 0.9).all() and (rmse_n > 1).all()


def test_without_correspondences_a_run_stays_where_it_began(objects):
    source, target, _ = clouds(objects, 0)
    poses_n = starts(6)
    poses_n[:5, :3, 3] += [[5, 0, 0], [0, -5, 0], [0, 0, 5], [1.2, 1.2, 1.2], [1e6, 0, 0]]
    poses, fitness, rmse = BatchedICP(target, ICPSettings()).register(source, poses_n)
    assert np.array_equal(poses[:5], poses_n[:5])
    assert not fitness[:5].any() and not rmse[:5].any()
    assert fitness[5] > 0.9  # the failures of the others are not its own
    assert_same((poses, fitness, rmse), by_open3d(source, target, None, ICPSettings(), poses_n))
    target, normals = ellipsoid(0, 300)
    far = exp(np.array([[0, 0, 0, 5.0, 0, 0], np.zeros(6)]))
    poses_2, fitness_2, rmse_2 = BatchedPlaneICP(target, normals, TO_PLANES).register(target, far)
    assert (poses_2[0] == far[0]).all()
    assert fitness_2.tolist() == [0, 1]
    assert (rmse_2 < 1e-6).all()


POOR = pairs.POOR | {"small": lambda points: points * 1e-3}


@pytest.mark.parametrize("poor", POOR)
def test_poor_targets_give_rigid_poses(objects, poor):
    """Where least squares leaves the motion open, another one than Open3D's may be chosen, but a rigid one."""
    source, target, _ = clouds(objects, 0)
    points = POOR[poor](target)
    poses, fitness, rmse = BatchedICP(points, ICPSettings()).register(source, starts(13))
    rotations = poses[:, :3, :3]
    assert np.allclose(rotations @ np.swapaxes(rotations, 1, 2), np.eye(3), atol=1e-9)
    assert np.allclose(np.linalg.det(rotations), 1)
    assert np.isfinite(rmse).all() and (rmse <= 0.1).all() and ((fitness >= 0) & (fitness <= 1)).all()


@pytest.mark.parametrize("matched", [1, 2])
def test_correspondences_with_one_single_point_do_not_turn_the_source(matched):
    random = np.random.default_rng(0)
    target = np.array([[0.3, 0.2, 0.1], [9, 9, 9], [-9, 9, 9]])
    source = np.concatenate([target[0] + random.uniform(-0.04, 0.04, (matched, 3)), random.uniform(50, 60, (5, 3))])
    poses_n = starts(5, spread=0.1)
    result = BatchedICP(target, ICPSettings()).register(source, poses_n)
    assert (result[1] == matched / len(source)).all()
    assert np.allclose(result[0][:, :3, :3], poses_n[:, :3, :3], atol=1e-9)
    assert_same(result, by_open3d(source, target, None, ICPSettings(), poses_n))


def test_least_squares_never_mirrors():
    """Correspondences whose best orthogonal map is a reflection: a flat cloud and its mirror image."""
    random = np.random.default_rng(0)
    target = random.uniform(-0.5, 0.5, size=(100, 3)) * [1, 1, 0.02]
    source = target * [1, 1, -1]
    result = BatchedICP(target, ICPSettings(max_iterations=1)).register(source, np.eye(4)[None])
    nearest = target[cKDTree(target).query(source)[1]]
    u, _, vt = np.linalg.svd((nearest - nearest.mean(axis=0)).T @ (source - source.mean(axis=0)))
    assert np.linalg.det(u @ vt) < 0
    assert np.linalg.det(result[0][0, :3, :3]) == pytest.approx(1)
    assert_same(result, by_open3d(source, target, None, ICPSettings(max_iterations=1), np.eye(4)[None]))


def test_a_run_does_not_depend_on_the_others_nor_on_earlier_calls(objects):
    source, target, _ = clouds(objects, 2)
    poses_n = starts(13, spread=2.0)
    icp = BatchedICP(target, ICPSettings())
    first = icp.register(source, poses_n)
    assert len(np.unique(first[0].round(6), axis=0)) > 1
    order = np.random.default_rng(0).permutation(13)
    for rows, result in (
        (slice(None), icp.register(source, poses_n)),
        (order, icp.register(source, poses_n[order])),
        (order, BatchedICP(target, ICPSettings()).register(source, poses_n[order])),
        ([4], icp.register(source, poses_n[[4]])),
        ([4, 4, 0], BatchedICP(target, ICPSettings()).register(source, poses_n[[4, 4, 0]])),
    ):
        for array, expected in zip(result, first, strict=True):
            assert np.array_equal(array, expected[rows])


def test_with_few_lists_the_poses_are_the_same(objects, monkeypatch):
    source, target, _ = clouds(objects, 2)
    expected = BatchedICP(target, ICPSettings()).register(source, starts(5))
    monkeypatch.setattr(batched_icp, "MOST_LISTS", 10)
    assert_same(BatchedICP(target, ICPSettings()).register(source, starts(5)), expected)


@pytest.mark.parametrize("method", get_args(Method))
@pytest.mark.parametrize(
    "faulty", [np.zeros((0, 3)), np.zeros((2, 3)), np.full((5, 3), np.nan), np.full((5, 3), np.inf)]
)
def test_too_few_points_and_nan_are_refused(objects, method, faulty):
    _, target, _ = clouds(objects, 0)
    with pytest.raises(InputError, match=r"source cloud: .* at least 3 finite points"):
        icp_to(target, ICPSettings(method)).register(faulty, starts(2))
    with pytest.raises(InputError, match=r"target cloud: .* at least 3 finite points"):
        icp_to(faulty, ICPSettings(method))


def test_runs_to_planes_end_where_open3d_ends():
    (target, normals), (source, _) = ellipsoid(0, 300), ellipsoid(1, 250)
    starts_n = exp(np.random.default_rng(2).normal(size=(20, 6)) * 0.08)
    poses_n, fitness_n, rmse_n = BatchedPlaneICP(target, normals, TO_PLANES).register(source, starts_n)
    icp = ICP(target, normals, TO_PLANES)
    for start, pose, fitness, rmse in zip(starts_n, poses_n, fitness_n, rmse_n, strict=True):
        theirs = icp.register(source, start)
        assert np.abs(pose - theirs.T_target_source).max() < 1e-6
        assert (fitness, rmse) == pytest.approx((theirs.fitness, theirs.inlier_rmse), abs=1e-6)


def test_what_planes_leave_open_stays():
    plane = np.column_stack([np.random.default_rng(0).uniform(-0.5, 0.5, size=(200, 2)), np.zeros(200)])
    start = exp(np.array([[0.05, -0.04, 0.0, 0.01, 0.02, 0.03]]))
    up = np.tile([0.0, 0.0, 1.0], (200, 1))
    poses_1, _, _ = BatchedPlaneICP(plane, up, TO_PLANES).register(plane, start)
    assert np.abs((plane @ poses_1[0, :3, :3].T + poses_1[0, :3, 3])[:, 2]).max() < 1e-6  # down on the plane
    assert poses_1[0, :2, 3] == pytest.approx(start[0, :2, 3], abs=5e-3)  # and not moved along it


def test_generalized_runs_end_where_open3d_ends(objects):
    source, target, _ = clouds(objects, 0)
    settings = ICPSettings("generalized")
    starts_n = starts(6)
    poses_n, fitness_n, _ = icp_to(target, settings).register(source, starts_n)
    theirs_n, fitness_o_n, _ = by_open3d(source, target, estimate_normals(target), settings, starts_n)
    assert np.median(np.abs(poses_n - theirs_n).max(axis=(1, 2))) < 5e-3
    assert fitness_n == pytest.approx(fitness_o_n, abs=0.02)
