"""The nearest target point of a point, compiled by numba: by the lists of :class:`gpca.alignment.icp_target.Target`."""

from __future__ import annotations

import numpy as np

from gpca.alignment.icp_target import LISTED
from gpca.process.compilation import INNER_LOOP, njit


@njit(forceinline=True, **INNER_LOOP)
def nearest(
    x,
    y,
    z,
    room,
    points,
    starts,
    low,
    cell,
    cells,
    voxel,
    voxels,
    list_of_voxel,
    listed,
    offsets,
    reach,
    used,
    distance,
):
    """Return the row of the target's point nearest to (x, y, z), -1 where none is within the distance, and a radius.

    Nowhere within that radius around (x, y, z) is another point nearer, or, after -1, any point within the distance.
    `room` (LISTED,) float64 is space to work in; the rest are the fields of :class:`gpca.alignment.icp_target.Target`.
    """
    per = 1.0 / voxel
    i_voxel = (x - low[0] + distance) * per
    j_voxel = (y - low[1] + distance) * per
    k_voxel = (z - low[2] + distance) * per
    if (
        not (i_voxel >= 0 and j_voxel >= 0 and k_voxel >= 0)
        or i_voxel >= voxels[0]
        or j_voxel >= voxels[1]
        or k_voxel >= voxels[2]
    ):
        return -1, 0.0
    i, j, k = int(i_voxel), int(j_voxel), int(k_voxel)
    center_x = low[0] - distance + (i + 0.5) * voxel
    center_y = low[1] - distance + (j + 0.5) * voxel
    center_z = low[2] - distance + (k + 0.5) * voxel
    flat = (i * voxels[1] + j) * voxels[2] + k
    row = list_of_voxel[flat]
    if row < 0 and used[0] < len(listed):
        row = used[0]
        used[0] += 1
        list_of_voxel[flat] = row
        reach[row] = _list_nearest(
            points,
            starts,
            low,
            cell,
            cells,
            distance + voxel,
            center_x,
            center_y,
            center_z,
            listed[row],
            offsets[row],
            room,
        )
    if row >= 0:
        dx, dy, dz = x - center_x, y - center_y, z - center_z
        chosen, first_square, second_square = _two_closest(offsets, row, dx, dy, dz)
        complete = reach[row] - np.sqrt(dx * dx + dy * dy + dz * dz)
        # What is not listed may be the second nearest. The radius leaves room for rounding.
        first, second = np.sqrt(first_square), min(np.sqrt(second_square), complete)
        if first < distance and first <= complete:
            return listed[row, chosen], max(0.0, 0.5 * (second - first) - 1e-9 * distance)
        if min(first, complete) >= distance:
            return -1, max(0.0, min(first, complete) - distance - 1e-9 * distance)
    return _search(points, starts, low, cell, cells, distance, x, y, z), 0.0


@njit(forceinline=True, **INNER_LOOP)
def _two_closest(offsets, row, dx, dy, dz):
    # Without a branch: which point is the nearest cannot be foreseen, and a wrong guess costs more than the rest.
    first, second, chosen = np.inf, np.inf, 0
    for slot in range(LISTED):
        a, b, c = offsets[row, 0, slot] - dx, offsets[row, 1, slot] - dy, offsets[row, 2, slot] - dz
        square = a * a + b * b + c * c
        second = min(second, max(first, square))
        chosen = slot if square < first else chosen
        first = min(first, square)
    return chosen, first, second


@njit(**INNER_LOOP)
def _list_nearest(points, starts, low, cell, cells, radius, x, y, z, listed, offsets, squares):
    """List the points nearest to a voxel's center; return how far the list is complete."""
    window = 1
    while True:
        squares[:] = radius * radius
        listed[:] = -1
        i_low, i_high = _cells_around(x, low[0], cell, cells[0], window)
        j_low, j_high = _cells_around(y, low[1], cell, cells[1], window)
        k_low, k_high = _cells_around(z, low[2], cell, cells[2], window)
        for i in range(i_low, i_high):
            for j in range(j_low, j_high):
                first, last = _points_of(starts, cells, i, j, k_low, k_high)
                for p in range(first, last):
                    square = _square(points, p, x, y, z)
                    if square < squares[LISTED - 1]:
                        slot = LISTED - 1
                        while slot > 0 and squares[slot - 1] > square:
                            squares[slot] = squares[slot - 1]
                            listed[slot] = listed[slot - 1]
                            slot -= 1
                        squares[slot] = square
                        listed[slot] = p
        reached = _reached(low, cell, x, y, z, window)
        if reached * reached >= squares[LISTED - 1]:
            break
        window += 1
    for slot in range(LISTED):
        p = listed[slot]
        offsets[0, slot] = points[p, 0] - x if p >= 0 else np.inf
        offsets[1, slot] = points[p, 1] - y if p >= 0 else np.inf
        offsets[2, slot] = points[p, 2] - z if p >= 0 else np.inf
    return np.sqrt(squares[LISTED - 1])


@njit(**INNER_LOOP)
def _search(points, starts, low, cell, cells, radius, x, y, z):
    """Search the cells around a point, in a growing window."""
    window = 1
    while True:
        best, index = radius * radius, -1
        i_low, i_high = _cells_around(x, low[0], cell, cells[0], window)
        j_low, j_high = _cells_around(y, low[1], cell, cells[1], window)
        k_low, k_high = _cells_around(z, low[2], cell, cells[2], window)
        for i in range(i_low, i_high):
            for j in range(j_low, j_high):
                first, last = _points_of(starts, cells, i, j, k_low, k_high)
                for p in range(first, last):
                    square = _square(points, p, x, y, z)
                    if square < best:
                        best, index = square, p
        reached = _reached(low, cell, x, y, z, window)
        if reached * reached >= best:
            return index
        window += 1


@njit(forceinline=True, **INNER_LOOP)
def _square(points, p, x, y, z):
    return (x - points[p, 0]) ** 2 + (y - points[p, 1]) ** 2 + (z - points[p, 2]) ** 2


@njit(**INNER_LOOP)
def _cells_around(x, low, cell, cells, window):
    i = int(np.floor((x - low) / cell))
    return max(0, i - window), min(cells, i + window + 1)


@njit(forceinline=True, **INNER_LOOP)
def _points_of(starts, cells, i, j, k_low, k_high):
    """Return where the points of a row of cells start and end; cells along the last axis follow each other."""
    if k_low >= k_high:
        return 0, 0
    row = (i * cells[1] + j) * cells[2]
    return starts[row + k_low], starts[row + k_high]


@njit(**INNER_LOOP)
def _reached(low, cell, x, y, z, window):
    """Return the least distance to anything outside the window: its cells, and the way to the nearest wall."""
    a, b, c = (x - low[0]) % cell, (y - low[1]) % cell, (z - low[2]) % cell
    wall = min(min(min(a, cell - a), min(b, cell - b)), min(c, cell - c))
    return window * cell + wall
