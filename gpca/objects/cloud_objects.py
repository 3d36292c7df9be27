"""Clouds that a caller hands over: arrays, lists, tensors, and clouds or meshes of Open3D, old and new."""

from __future__ import annotations

from typing import Any

import numpy as np

from gpca.errors import InputError

REMEDY = "give an (N, 3) array or a point cloud of Open3D"


def as_points(cloud: Any, role: str) -> np.ndarray:
    """Return the points of a cloud as (N, 3) float64.

    Open3D is not imported: its clouds are known by what they have, ``points`` or ``point.positions``.

    Args:
        cloud: anything that NumPy makes an array of, a tensor on any device, or a cloud of Open3D.
        role: what the cloud is, for messages.

    Raises:
        InputError: something else, or an array of another shape.
    """
    values = cloud
    if not isinstance(cloud, np.ndarray):
        if hasattr(cloud, "points"):  # of open3d.geometry.PointCloud, and of trimesh's scans
            values = cloud.points
        elif hasattr(cloud, "point"):  # a map of tensors, of open3d.t.geometry.PointCloud
            values = _positions(cloud, role)
        elif hasattr(cloud, "vertices"):
            raise InputError(role, f"is a mesh ({type(cloud).__name__})", "sample points on it first")
        values = _on_the_cpu(values)
    try:
        points = np.asarray(values, np.float64)
    except (TypeError, ValueError) as fault:
        raise InputError(role, f"is a {type(cloud).__name__}, not a cloud of points", REMEDY) from fault
    if points.ndim != 2 or points.shape[1] != 3:
        advice = "transpose it" if points.ndim == 2 and points.shape[0] == 3 else REMEDY
        raise InputError(role, f"has the shape {points.shape}, not (N, 3)", advice)
    return points


def _positions(cloud: Any, role: str) -> Any:
    try:
        return cloud.point["positions"]
    except (KeyError, TypeError, RuntimeError) as fault:
        raise InputError(role, f"is a {type(cloud).__name__} without positions", REMEDY) from fault


def _on_the_cpu(tensor: Any) -> Any:
    """Return a tensor of torch or of Open3D as an array; anything else as it is."""
    for name in ("detach", "cpu", "numpy"):
        if (method := getattr(tensor, name, None)) is not None:
            tensor = method()
    return tensor
