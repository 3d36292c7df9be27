"""How much of a scan another one has seen too, where the data set does not print it.

The share of the target's points that have a point of the source within :data:`gpca.scans.pair.OVERLAP_M`, at the true
pose and after both were thinned to voxels, so that the density of points near a sensor does not count. It is the
target's share because that is what is printed for 3DMatch and 3DLoMatch (Huang et al. 2021).
"""

from __future__ import annotations

import numpy as np

from gpca.alignment.rigid import transform
from gpca.errors import InputError
from gpca.scans.pair import OVERLAP_M, near

VOXEL_M = 0.025  # in a room: the voxels of 3DMatch's benchmark
MOST_CELLS = 2.0**62


def overlap(source_N_3: np.ndarray, target_M_3: np.ndarray, T_target_source: np.ndarray, scale: float = 1.0) -> float:
    """Return the share of the target's surface in [0, 1] that the source has as well.

    Args:
        source_N_3, target_M_3: points, each in its own frame (m).
        T_target_source: the true pose.
        scale: as of :attr:`gpca.scans.pair.ScanPair.scale`.
    """
    edge = VOXEL_M * scale
    return overlap_of_voxels(voxels(source_N_3, edge), voxels(target_M_3, edge), T_target_source, scale)


def overlap_of_voxels(
    source_n_3: np.ndarray, target_m_3: np.ndarray, T_target_source: np.ndarray, scale: float = 1.0
) -> float:
    """Return the same of clouds that were thinned to voxels before."""
    return float(near(target_m_3, transform(T_target_source, source_n_3), OVERLAP_M * scale).mean())


def voxels(points_N_3: np.ndarray, edge: float) -> np.ndarray:
    """Return the mean (n, 3) of the points in each cube of a grid, sorted by cube; the edge has the points' unit.

    Raises:
        InputError: the points span more cubes than can be numbered.
    """
    points_N_3 = np.asarray(points_N_3, np.float64)
    cell_N_3 = np.floor((points_N_3 - points_N_3.min(axis=0)) / edge)
    sizes_3 = cell_N_3.max(axis=0) + 1
    if sizes_3.prod() > MOST_CELLS:
        fault = f"spans {np.ptp(points_N_3, axis=0).max():.3g} m, too much for voxels of {edge:.3g} m"
        raise InputError("scan", fault, "correct its unit, or leave out points that are far away")
    key_N = np.ravel_multi_index(cell_N_3.astype(np.int64).T, sizes_3.astype(np.int64))
    _, of_cell_N, count_n = np.unique(key_N, return_inverse=True, return_counts=True)
    sums = [np.bincount(of_cell_N.ravel(), weights=axis) for axis in points_N_3.T]
    return np.stack(sums, axis=1) / count_n[:, None]
