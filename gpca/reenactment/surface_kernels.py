"""Many searches for the nearest point of a model, compiled by numba."""

from __future__ import annotations

import numpy as np

from gpca.alignment.icp_neighbors import nearest
from gpca.alignment.icp_target import LISTED
from gpca.process.compilation import njit


@njit(cache=True, error_model="numpy")
def nearest_rows(searched, target, rows, distances):
    """Fill the row of the target's point nearest to each point (N, 3), -1 where none is within reach, and how far."""
    room = np.empty(LISTED)
    points, starts, low, cell, cells, voxel, voxels, list_of_voxel, listed, offsets, reach, used, distance = target
    lists = (voxel, voxels, list_of_voxel, listed, offsets, reach, used, distance)
    for i in range(len(searched)):
        x, y, z = searched[i, 0], searched[i, 1], searched[i, 2]
        row, _ = nearest(x, y, z, room, points, starts, low, cell, cells, *lists)
        rows[i] = row
        if row >= 0:
            dx, dy, dz = x - points[row, 0], y - points[row, 1], z - points[row, 2]
            distances[i] = np.sqrt(dx * dx + dy * dy + dz * dz)
        else:
            distances[i] = distance
