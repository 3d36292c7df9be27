"""Many searches for the nearest point of a model, compiled by numba."""

from __future__ import annotations

import numpy as np

from gpca.alignment.icp_kernels import LISTED, nearest
from gpca.process.compilation import njit


@njit(cache=True, error_model="numpy")
def nearest_rows(searched, target, rows):
    """Fill the row of the target's point nearest to each point (N, 3), -1 where none is within reach."""
    room = np.empty(LISTED)
    points, starts, low, cell, cells, voxel, voxels, list_of_voxel, listed, offsets, reach, used, distance = target
    lists = (voxel, voxels, list_of_voxel, listed, offsets, reach, used, distance)
    for i in range(len(searched)):
        x, y, z = searched[i, 0], searched[i, 1], searched[i, 2]
        rows[i] = nearest(x, y, z, room, points, starts, low, cell, cells, *lists)[0]


@njit(cache=True, error_model="numpy")
def surface_distances(searched, target, normals, reach, distances):
    """Fill the distance of each point (N, 3) from the surface, the target's own where no point of it is within that.

    Args:
        normals: (P, 3) of the target's points.
        reach: (P,) how far the surface reaches from each point, along its plane.
    """
    room = np.empty(LISTED)
    points, starts, low, cell, cells, voxel, voxels, list_of_voxel, listed, offsets, within, used, distance = target
    lists = (voxel, voxels, list_of_voxel, listed, offsets, within, used, distance)
    for i in range(len(searched)):
        x, y, z = searched[i, 0], searched[i, 1], searched[i, 2]
        row, _ = nearest(x, y, z, room, points, starts, low, cell, cells, *lists)
        if row < 0:
            distances[i] = distance
            continue
        dx, dy, dz = x - points[row, 0], y - points[row, 1], z - points[row, 2]
        square = dx * dx + dy * dy + dz * dz
        off = dx * normals[row, 0] + dy * normals[row, 1] + dz * normals[row, 2]
        along = max(np.sqrt(max(square - off * off, 0.0)) - reach[row], 0.0)
        distances[i] = np.sqrt(min(off * off + along * along, square))
