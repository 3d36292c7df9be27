"""ICP of one source to one target from many poses: compiled loops, as Open3D's (docs/protocol.md#two-loops-of-icp)."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from gpca.alignment.features import estimate_normals
from gpca.alignment.icp import CONVERGED, ICPSettings, require_cloud
from gpca.alignment.icp_kernels import LISTED, align_all, plane_all, pull_all
from gpca.rigid import rigid_motion

Arrays = tuple[np.ndarray, ...]
MOST_LISTS = 1 << 16  # beyond that, queries in new voxels search the cells
NO_NORMALS = np.empty((0, 3))
SINGULAR = 1e-10  # eigenvalue, relative to the largest, below which a step leaves its direction alone


class Target(NamedTuple):
    """Points sorted into cubic cells, and lists of the points nearest to the centers of voxels, which queries fill."""

    points: np.ndarray  # (P, 3) in the order of their cells; a neighbor is a row of it
    starts: np.ndarray  # first point of each cell, and the end of the last one
    low: np.ndarray  # (3,) corner of the cells; the voxels begin `distance` before it
    cell: float  # edge
    cells: np.ndarray  # number along each axis
    voxel: float
    voxels: np.ndarray
    list_rows: np.ndarray  # row of a voxel's list, -1 before it has one
    listed: np.ndarray  # (lists, LISTED) points
    offsets: np.ndarray  # (lists, 3, LISTED) their positions from the voxel's center
    reach: np.ndarray  # minimum distance of all unlisted points from the center
    used: np.ndarray  # (1,) number of lists
    distance: float  # farther points are no neighbors; unit of the points


def make_target(points: np.ndarray, distance: float) -> Target:
    """Sort points (P, 3) for searches within `distance`, in the unit of the points."""
    low, high = points.min(axis=0).astype(np.float64), points.max(axis=0)
    extent = max(float((high - low).max()), 1e-9)
    # The points lie on a surface: their number grows with the square of the extent.
    spacing = extent / np.sqrt(len(points))
    # However small the cloud, a cell must not be far smaller than the distance: searches widen cell by cell.
    cell = max(1.5 * spacing, distance / 128)
    cells = np.floor((high - low) / cell).astype(np.int64) + 1
    cell_P = np.ravel_multi_index(tuple(np.floor((points - low) / cell).astype(np.int64).T), tuple(cells))
    order = np.argsort(cell_P, kind="stable")
    voxel = max(1.5 * spacing, (extent + 2 * distance) / 128)
    voxels = np.floor((high - low + 2 * distance) / voxel).astype(np.int64) + 1
    lists = min(MOST_LISTS, int(np.prod(voxels)))
    return Target(
        points=np.ascontiguousarray(points[order], np.float64),
        starts=np.searchsorted(cell_P[order], np.arange(np.prod(cells) + 1)),
        low=low,
        cell=cell,
        cells=cells,
        voxel=voxel,
        voxels=voxels,
        list_rows=np.full(int(np.prod(voxels)), -1, np.int32),
        listed=np.empty((lists, LISTED), np.int32),
        offsets=np.empty((lists, 3, LISTED)),
        reach=np.empty(lists),
        used=np.zeros(1, np.int64),
        distance=float(distance),
    )


class BatchedICP:
    """Point-to-point ICP to one target (P, 3), in any unit, which the results and the correspondence distance share."""

    def __init__(self, target: np.ndarray, settings: ICPSettings) -> None:
        require_cloud("target cloud", target)
        self._iterations = settings.max_iterations
        self._target = make_target(target, settings.correspondence_distance)

    def register(self, source: np.ndarray, T_target_source_n: np.ndarray, max_iterations: int | None = None) -> Arrays:
        """Align `source` (N, 3) from poses (n, 4, 4): poses, fitness, inlier RMSE (n,); 0 iterations only measure."""
        require_cloud("source cloud", source)
        poses_n = np.array(T_target_source_n, np.float64)
        fitness_n, rmse_n = np.empty(len(poses_n)), np.empty(len(poses_n))
        source = np.ascontiguousarray(source, np.float64)
        iterations = self._iterations if max_iterations is None else max_iterations
        align_all(source, self._target, poses_n, fitness_n, rmse_n, iterations, CONVERGED)
        return poses_n, fitness_n, rmse_n


def pulls(target: Target, source: np.ndarray, T_target_source_n: np.ndarray) -> Arrays:
    """Return the mean of [y × r, r] (n, 6) over correspondences of `source` (N, 3), fitness (n,) and RMSE (n,).

    r = y - q is the offset of the moved point y from its neighbor q, and the mean half the gradient of that of |r|².
    """
    n = len(T_target_source_n)
    pulls_n_6, fitness_n, rmse_n = np.empty((n, 6)), np.empty(n), np.empty(n)
    source = np.ascontiguousarray(source, np.float64)
    pull_all(source, target, np.ascontiguousarray(T_target_source_n), pulls_n_6, fitness_n, rmse_n)
    return pulls_n_6, fitness_n, rmse_n


class BatchedPlaneICP:
    """Point-to-plane or generalized ICP to one target (P, 3), by normals that are given or estimated."""

    def __init__(self, target: np.ndarray, target_normals: np.ndarray | None, settings: ICPSettings) -> None:
        require_cloud("target cloud", target)
        target_normals = estimate_normals(target) if target_normals is None else target_normals
        self._generalized = settings.method == "generalized"
        self._target = make_target(target, settings.correspondence_distance)
        # The kernel has the points in the order of its cells.
        rows_P = cKDTree(target).query(self._target.points)[1]
        self._normals = np.ascontiguousarray(target_normals[rows_P], np.float64)
        self.iterations = settings.max_iterations

    def register(self, source: np.ndarray, T_target_source_n: np.ndarray, max_iterations: int | None = None) -> Arrays:
        """Align `source` (N, 3) from n initial poses (n, 4, 4), as :meth:`BatchedICP.register`."""
        require_cloud("source cloud", source)
        normals = np.ascontiguousarray(estimate_normals(source)) if self._generalized else NO_NORMALS
        source = np.ascontiguousarray(source, np.float64)
        poses_n = np.array(T_target_source_n, np.float64)
        iterations = self.iterations if max_iterations is None else max_iterations
        return _descend(lambda rows_m: self.sums(source, poses_n[rows_m], normals), poses_n, iterations)

    def sums(self, source: np.ndarray, poses_n: np.ndarray, source_normals: np.ndarray = NO_NORMALS) -> Arrays:
        """Return Σ JᵀJ (n, 6, 6) and Σ Jᵀd (n, 6) of the plane distances d, fitness (n,) and inlier RMSE (n,)."""
        n = len(poses_n)
        sums = np.empty((n, 6, 6)), np.empty((n, 6)), np.empty(n), np.empty(n)
        plane_all(source, source_normals, self._target, self._normals, np.ascontiguousarray(poses_n), *sums)
        return sums


AnyICP = BatchedICP | BatchedPlaneICP


def icp_to(target: np.ndarray, settings: ICPSettings) -> AnyICP:
    """Return the ICP to a target (P, 3) without normals; methods that need some estimate them."""
    if settings.method == "point_to_point":
        return BatchedICP(target, settings)
    return BatchedPlaneICP(target, None, settings)


def register_each(
    icps: Sequence[BatchedPlaneICP], sources: Sequence[np.ndarray], T_target_source_n: np.ndarray
) -> Arrays:
    """Align n sources, each (N, 3), to n targets from one pose each, in lockstep; see :meth:`BatchedICP.register`."""
    sources = [np.ascontiguousarray(source, np.float64) for source in sources]
    poses_n = np.array(T_target_source_n, np.float64)

    def sums(rows_m: np.ndarray) -> Arrays:
        each = [icps[row].sums(sources[row], poses_n[row : row + 1]) for row in rows_m]
        return tuple(np.concatenate(parts) for parts in zip(*each, strict=True))

    return _descend(sums, poses_n, icps[0].iterations)


def _descend(sums: Callable[[np.ndarray], Arrays], poses_n: np.ndarray, iterations: int) -> Arrays:
    """Move the poses (n, 4, 4) in place until they converge; `sums` returns the sums at the given rows (m,)."""
    hessian_n, gradient_n, fitness_n, rmse_n = sums(np.arange(len(poses_n)))
    active = np.flatnonzero(fitness_n > 0)
    for _ in range(iterations):
        if not len(active):
            break
        # Gauss-Newton steps of least norm, as :func:`gpca.rigid.plane_step`.
        values_m_6, axes_m_6_6 = np.linalg.eigh(hessian_n[active])
        held_m_6 = values_m_6 > SINGULAR * values_m_6[:, -1:]
        along_m_6 = np.einsum("nji,nj->ni", axes_m_6_6, gradient_n[active])
        along_m_6 = np.where(held_m_6, along_m_6 / np.where(held_m_6, values_m_6, 1.0), 0.0)
        steps_m_6 = -np.einsum("nij,nj->ni", axes_m_6_6, along_m_6)
        steps_m = rigid_motion(Rotation.from_euler("xyz", steps_m_6[:, :3]).as_matrix(), steps_m_6[:, 3:])
        poses_n[active] = steps_m @ poses_n[active]
        hessian_m, gradient_m, fitness_m, rmse_m = sums(active)
        settled = (np.abs(fitness_m - fitness_n[active]) < CONVERGED) & (np.abs(rmse_m - rmse_n[active]) < CONVERGED)
        hessian_n[active], gradient_n[active] = hessian_m, gradient_m
        fitness_n[active], rmse_n[active] = fitness_m, rmse_m
        active = active[~settled & (fitness_m > 0)]
    return poses_n, fitness_n, rmse_n
