"""Point-to-plane ICP of one source to one target from many initial poses, all of them one step at a time.

The steps and the stopping rule are Open3D's, which needs some milliseconds for each start; where a step is determined,
so are its poses (tests/alignment/test_batched_plane_icp.py).
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from gpca.alignment.icp import ICPSettings, require_cloud
from gpca.alignment.icp_kernels import CONVERGED, plane_all
from gpca.alignment.icp_target import make_target

SINGULAR = 1e-10  # eigenvalue, in the largest, below which a step leaves its direction alone


class BatchedPlaneICP:
    """ICP to the planes of one target.

    Args:
        target, target_normals: (P, 3) points, any unit; results come in the same.
        settings: correspondence distance in the unit of the points, and iterations.
    """

    def __init__(self, target: np.ndarray, target_normals: np.ndarray, settings: ICPSettings) -> None:
        require_cloud("target cloud", target)
        self._target = make_target(target, settings.correspondence_distance)
        # The kernel has the points in the order of its cells.
        rows_P = cKDTree(target).query(self._target.points)[1]
        self._normals = np.ascontiguousarray(target_normals[rows_P], np.float64)
        self._iterations = settings.max_iterations

    def register(self, source: np.ndarray, T_target_source_init_n: np.ndarray) -> tuple[np.ndarray, ...]:
        """Align `source` (N, 3) from n initial poses (n, 4, 4); see :meth:`gpca.alignment.batched_icp.BatchedICP`."""
        require_cloud("source cloud", source)
        source = np.ascontiguousarray(source, np.float64)
        poses_n = np.array(T_target_source_init_n, np.float64)
        hessian_n, gradient_n, fitness_n, rmse_n = self._sums(source, poses_n)
        active = np.flatnonzero(fitness_n > 0)
        for _ in range(self._iterations):
            if not len(active):
                break
            poses_n[active] = _steps(hessian_n[active], gradient_n[active]) @ poses_n[active]
            of_active = self._sums(source, poses_n[active])
            settled = (np.abs(of_active[2] - fitness_n[active]) < CONVERGED) & (
                np.abs(of_active[3] - rmse_n[active]) < CONVERGED
            )
            for kept, new in zip((hessian_n, gradient_n, fitness_n, rmse_n), of_active, strict=True):
                kept[active] = new
            active = active[~settled & (of_active[2] > 0)]
        return poses_n, fitness_n, rmse_n

    def _sums(self, source: np.ndarray, poses_n: np.ndarray) -> tuple[np.ndarray, ...]:
        n = len(poses_n)
        sums = np.empty((n, 6, 6)), np.empty((n, 6)), np.empty(n), np.empty(n)
        plane_all(source, self._target, self._normals, np.ascontiguousarray(poses_n), *sums)
        return sums


def _steps(hessian_n_6_6: np.ndarray, gradient_n_6: np.ndarray) -> np.ndarray:
    """Return Gauss-Newton steps (n, 4, 4); open directions stay (:func:`gpca.alignment.least_squares.plane_step`)."""
    values_n_6, axes_n_6_6 = np.linalg.eigh(hessian_n_6_6)
    held_n_6 = values_n_6 > SINGULAR * values_n_6[:, -1:]
    along_n_6 = np.einsum("nji,nj->ni", axes_n_6_6, gradient_n_6)
    along_n_6 = np.where(held_n_6, along_n_6 / np.where(held_n_6, values_n_6, 1.0), 0.0)
    steps_n_6 = -np.einsum("nij,nj->ni", axes_n_6_6, along_n_6)
    T_n = np.tile(np.eye(4), (len(steps_n_6), 1, 1))
    T_n[:, :3, :3], T_n[:, :3, 3] = Rotation.from_euler("xyz", steps_n_6[:, :3]).as_matrix(), steps_n_6[:, 3:]
    return T_n
