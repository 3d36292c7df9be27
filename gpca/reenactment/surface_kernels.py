"""Compiled loops behind :class:`gpca.reenactment.surface.ModelSurface` and the search for what a surface misses."""

from __future__ import annotations

import numpy as np

from gpca.alignment.icp_kernels import LISTED, TARGET, nearest
from gpca.process.compilation import njit


@njit(ahead=f"d2 {TARGET} l1", cache=True, error_model="numpy")
def nearest_rows(searched, target, rows):
    """Fill the row of the target's point nearest to each point (N, 3), -1 where none is within reach."""
    room = np.empty(LISTED)
    points, starts, low, cell, cells, voxel, voxels, list_of_voxel, listed, offsets, reach, used, distance = target
    lists = (voxel, voxels, list_of_voxel, listed, offsets, reach, used, distance)
    for i in range(len(searched)):
        x, y, z = searched[i, 0], searched[i, 1], searched[i, 2]
        rows[i] = nearest(x, y, z, room, points, starts, low, cell, cells, *lists)[0]


@njit(ahead=f"d2 {TARGET} d2 d1 d1", cache=True, error_model="numpy")
def surface_distances(searched, target, normals, reach, distances):
    """Fill the distance of each point (N, 3) from the surface, the target's own where no point of it is within that.

    The target's points have normals (P, 3) and reach (P,): how far the surface reaches from them, along their planes.
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


@njit(ahead="d2 d2 d2 d1 l d1 d1", cache=True, error_model="numpy")
def shares_within(directions, observed, model, blur, beyond, limits, shares):
    """For each direction (K, 3) fill the limit with so many observed points beyond, and the model's share within."""
    largest = np.empty(beyond + 1)
    for k in range(len(directions)):
        x, y, z = directions[k, 0], directions[k, 1], directions[k, 2]
        largest[:] = -np.inf
        for i in range(len(observed)):
            along = observed[i, 0] * x + observed[i, 1] * y + observed[i, 2] * z
            if along > largest[beyond]:
                slot = beyond
                while slot > 0 and largest[slot - 1] < along:
                    largest[slot] = largest[slot - 1]
                    slot -= 1
                largest[slot] = along
        limits[k] = largest[beyond]
        within = 0
        for m in range(len(model)):
            within += model[m, 0] * x + model[m, 1] * y + model[m, 2] * z + blur[m] <= limits[k]
        shares[k] = within / len(model)
