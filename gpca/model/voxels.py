"""Thins two scans to one point per voxel, whose size is chosen by how densely they were measured."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.canonical_frame import thin
from gpca.errors import InputError
from gpca.scans.pair import MOST_CELLS, voxels

SPACINGS = 2.0  # of the points, at least, in the edge of a voxel
MOST_VOXELS = 4000  # that a scan is thinned to; the edge grows until it has no more
GROWTH = 1.25  # of the edge, at least, in each step
MEASURED = 5000  # points whose spacing is measured


def voxel_size(clouds: Mapping[str, np.ndarray], unit: str) -> float:
    """Return the edge of the voxels for scans (N, 3), in their unit.

    It is at least twice the larger median distance between neighbors, and so large that no scan keeps more than
    `MOST_VOXELS` points.

    Args:
        clouds: by what they are called in messages.

    Raises:
        InputError: all points of a scan coincide, or some lie so far away that no voxels can be numbered.
    """
    edge = SPACINGS * max(_spacing(points, name) for name, points in clouds.items())
    while (most := max(len(in_voxels(points, edge, name, unit)) for name, points in clouds.items())) > MOST_VOXELS:
        edge *= max(GROWTH, float(np.sqrt(most / MOST_VOXELS)))  # a surface fills a quarter of voxels twice as large
    return edge


def require_edge(edge: float, subject: str) -> None:
    """Raise an InputError unless the edge of a voxel is a length."""
    if not 0 < edge < np.inf:
        raise InputError(subject, f"{edge:g} is no length", "give a positive one")


def in_voxels(points: np.ndarray, edge: float, name: str, unit: str) -> np.ndarray:
    """Return the mean (n, 3) of the points (N, 3) in each voxel; an InputError if they span too many."""
    with np.errstate(over="ignore"):
        extent_3 = np.ptp(points, axis=0)
        cells = (extent_3 / edge + 1).prod()
    if not cells < MOST_CELLS:
        fault = f"spans {extent_3.max():.3g} {unit}, too much for voxels of {edge:.3g} {unit}"
        raise InputError(name, fault, "leave out points that are far away")
    return voxels(points, edge)


def _spacing(points: np.ndarray, name: str) -> float:
    """Return the median distance of points to their neighbors; one that is there several times counts once."""
    spacing = _median_gap(points) or _median_gap(np.unique(points, axis=0))
    if not 0 < spacing < np.inf:
        raise InputError(name, "has all its points in one place", "export it again")
    return spacing


def _median_gap(points: np.ndarray) -> float:
    some = thin(points, MEASURED, "spacing")
    return float(np.median(cKDTree(points).query(some, 2)[0][:, 1]))
