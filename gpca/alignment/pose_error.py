"""Errors of poses, ADD, and ADD-S for symmetric objects (Hinterstoisser et al. 2012), and when they are a success."""

from dataclasses import dataclass

import numpy as np

from gpca.errors import InputError
from gpca.rigid import transform
from gpca.settings import Distinct, PositiveShare

JUDGED_POINTS = 1000  # the first points of an object, over which errors are usually averaged


@dataclass(frozen=True)
class SuccessSettings:
    """The section ``success`` of the config, in diameters."""

    error: PositiveShare = 0.03  # smallest of a failure, ADD or ADD-S
    curve: Distinct[PositiveShare] = (0.02, 0.03, 0.05, 0.10)  # other limits at which shares of successes are shown

    def __post_init__(self) -> None:
        if list(self.curve) != sorted(self.curve):
            raise InputError("success curve", f"{list(self.curve)} is not in ascending order", "sort it")


def success_within(error: float) -> str:
    """Return the name of the metric for another limit, e.g. ``success_10`` for 10 %."""
    return f"success_{100 * error:g}"


def adds_error(points_N_3: np.ndarray, T_estimated: np.ndarray, T_true: np.ndarray) -> float:
    """Return the mean distance from each point under the estimate to the nearest under the truth (ADD-S)."""
    from scipy.spatial import cKDTree

    distances_N, _ = cKDTree(transform(T_true, points_N_3)).query(transform(T_estimated, points_N_3))
    return float(distances_N.mean())


def pose_error(points_N_3: np.ndarray, T_estimated: np.ndarray, T_true: np.ndarray, symmetric: bool) -> float:
    """Return ADD-S of a symmetric object, and else ADD, the mean distance of its points under the two poses."""
    if symmetric:
        return adds_error(points_N_3, T_estimated, T_true)
    return float(np.linalg.norm(transform(T_estimated, points_N_3) - transform(T_true, points_N_3), axis=1).mean())


def displacements(T_n: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the root mean square distance (n,) by which each transform (n, 4, 4) moves the points (N, 3)."""
    squared_n = np.zeros(len(T_n))
    x, y, z = points.T
    for i, coordinate in enumerate((x, y, z)):
        a, b, c, t = (T_n[:, i, j, None] for j in range(4))
        squared_n += np.square(a * x + b * y + c * z + t - coordinate).mean(axis=1)
    return np.sqrt(squared_n)


class PoseErrors:
    """Errors of estimates where the truth is the identity, over the first `judged` points; neighbors among all."""

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
