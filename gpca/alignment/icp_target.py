"""The target of point-to-point ICP as its searches take it: points sorted into cells, and voxels with lists of points.

Space is cut into voxels. The first point that falls into one has the target points nearest to the voxel's center
listed; every later point there, in whichever iteration and from whichever initial pose, finds its neighbor among
those. A list says how far it is complete; where that does not suffice, the point is searched by itself, so the
neighbor is always the true one (:mod:`gpca.alignment.icp_neighbors`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

LISTED = 16  # target points per voxel
MOST_LISTS = 1 << 16  # beyond that, points in new voxels are searched by themselves


class Target(NamedTuple):
    """Points sorted into cubic cells, and the voxels' lists, which the searches fill.

    Attributes:
        points: (P, 3) in the order of their cells; a neighbor is a row of it.
        starts: where each cell's points start, and where the last one's end.
        low: (3,) corner of the cells; the voxels begin `distance` before it.
        cell, cells: edge of a cell, number along each axis.
        voxel, voxels: the same of the voxels.
        list_of_voxel: row of its list, -1 before it has one.
        listed, offsets: (lists, LISTED) points, (lists, 3, LISTED) their positions from the voxel's center.
        reach: every point that is not in the list is at least so far from the center.
        used: (1,) number of lists.
        distance: farther points are no neighbors; unit of the points.
    """

    points: np.ndarray
    starts: np.ndarray
    low: np.ndarray
    cell: float
    cells: np.ndarray
    voxel: float
    voxels: np.ndarray
    list_of_voxel: np.ndarray
    listed: np.ndarray
    offsets: np.ndarray
    reach: np.ndarray
    used: np.ndarray
    distance: float


def make_target(points: np.ndarray, distance: float) -> Target:
    """Sort points (P, 3) for searches within `distance`, in the unit of the points."""
    low, high = points.min(axis=0).astype(np.float64), points.max(axis=0)
    extent = max(float((high - low).max()), 1e-9)
    # The points lie on a surface: their number grows with the square of the extent, not with its cube.
    spacing = extent / np.sqrt(len(points))
    # A cell must not be far smaller than the distance, however small the cloud: the searches widen cell by cell.
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
        list_of_voxel=np.full(int(np.prod(voxels)), -1, np.int32),
        listed=np.empty((lists, LISTED), np.int32),
        offsets=np.empty((lists, 3, LISTED)),
        reach=np.empty(lists),
        used=np.zeros(1, np.int64),
        distance=float(distance),
    )
