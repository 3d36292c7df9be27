"""How far an estimated pose is off: ADD, and ADD-S for symmetric objects (Hinterstoisser et al. 2012)."""

from __future__ import annotations

import numpy as np

from gpca.alignment.rigid import transform

CORRECT = 0.1  # diameters: the usual limit of a correct pose


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
