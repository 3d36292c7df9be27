"""How far an estimated pose is off: ADD, and ADD-S for symmetric objects (Hinterstoisser et al. 2012)."""

from __future__ import annotations

import numpy as np

from gpca.alignment.rigid import transform

JUDGED_POINTS = 1000  # of an object, the first ones, over which an error is usually the mean


def add_error(points_N_3: np.ndarray, T_estimated: np.ndarray, T_true: np.ndarray) -> float:
    """Return the mean distance of the object's points under the two poses (ADD), in their unit."""
    return float(np.linalg.norm(transform(T_estimated, points_N_3) - transform(T_true, points_N_3), axis=1).mean())


def adds_error(points_N_3: np.ndarray, T_estimated: np.ndarray, T_true: np.ndarray) -> float:
    """Return the mean distance from each point under the estimate to the nearest under the truth (ADD-S)."""
    from scipy.spatial import cKDTree

    distances_N, _ = cKDTree(transform(T_true, points_N_3)).query(transform(T_estimated, points_N_3))
    return float(distances_N.mean())


def pose_error(points_N_3: np.ndarray, T_estimated: np.ndarray, T_true: np.ndarray, symmetric: bool) -> float:
    """Return ADD-S where the object is symmetric and ADD elsewhere."""
    return (adds_error if symmetric else add_error)(points_N_3, T_estimated, T_true)


def displacements(T_n: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the root mean square distance (n,) by which each transform (n, 4, 4) moves the points (N, 3)."""
    x, y, z = points.T
    squared_n = np.zeros(len(T_n))
    for i, own in enumerate((x, y, z)):
        a, b, c, t = (T_n[:, i, j, None] for j in range(4))
        squared_n += np.square(a * x + b * y + c * z + t - own).mean(axis=1)
    return np.sqrt(squared_n)


class PoseErrors:
    """Errors of many estimates of one object's pose, where the truth is the identity.

    ADD-S is the mean distance to the nearest point, so it is not below the spacing of the points: the mean is over some
    of them, but the nearest is sought among all.

    Args:
        points_N_3: of the object, in any unit; errors come in the same.
        judged: how many of the points, the first ones, the mean is over.
        symmetric: whether ADD-S counts.
    """

    def __init__(self, points_N_3: np.ndarray, judged: int, symmetric: bool) -> None:
        from scipy.spatial import cKDTree

        self._points_P_3 = np.asarray(points_N_3[:judged], np.float64)
        self._tree = cKDTree(points_N_3) if symmetric else None

    def __call__(self, T_estimated_n: np.ndarray) -> np.ndarray:
        """Return the errors (n,) of the estimates (n, 4, 4)."""
        moved_n_P_3 = np.stack([transform(T, self._points_P_3) for T in T_estimated_n])
        if self._tree is None:
            return np.linalg.norm(moved_n_P_3 - self._points_P_3, axis=2).mean(axis=1)
        return self._tree.query(moved_n_P_3)[0].mean(axis=1)
