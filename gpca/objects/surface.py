"""Surfaces, as every kind of source yields them; names of views; clouds that a caller of Python gives."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from gpca.errors import InputError

T = TypeVar("T")


@dataclass(frozen=True)
class Surface:
    """One object as its source gives it."""

    name: str  # unique within the source
    vertices_m: np.ndarray  # (V, 3) float64, meters, in the source's own frame
    faces: np.ndarray | None  # (F, 3) int64 triangles, or None for a point cloud
    normals: np.ndarray | None = None  # (V, 3) unit normals of a point cloud; estimated from the points when None

    @property
    def triangles(self) -> np.ndarray:
        """The faces of a surface that must be a mesh."""
        if self.faces is None:
            raise ValueError(f"{self.name} is a point cloud")
        return self.faces


def evenly(items: Sequence[T], most: int) -> list[T]:
    """Return at most this many items, evenly spread; the last is left out, since a turntable ends where it began."""
    return [items[i] for i in np.linspace(0, len(items), min(most, len(items)), endpoint=False).astype(int)]


def instance_of(name: str) -> str:
    """Return the instance that a view shows, by its name; a name of another form is its own instance."""
    return view_order(name)[0]


def view_order(name: str) -> tuple[str, int, int]:
    """Return instance, sequence and frame of a name such as ``coffee_mug_1_2_14``; else the name itself, 0 and 0."""
    match = re.fullmatch(r"(.+)_([0-9]+)_([0-9]+)", name)
    return (match[1], int(match[2]), int(match[3])) if match else (name, 0, 0)


METERS_PER_UNIT = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
UNIT_NAMES = {"m": "meters", "cm": "centimeters", "mm": "millimeters"}


def meters_per(unit: str | None) -> float:
    """Return the meters in one `unit`; InputError for a unit other than m, cm, mm."""
    if unit not in METERS_PER_UNIT:
        raise InputError(f"unit '{unit}'", "is not a known unit of length", "set unit: m, cm or mm")
    return METERS_PER_UNIT[unit]


def in_unit(points: np.ndarray, own_unit: str | None, unit: str) -> np.ndarray:
    """Convert points to a unit from one of their own, if they have one."""
    return points if own_unit in (None, unit) else points * (meters_per(own_unit) / meters_per(unit))


REMEDY = "give an (N, 3) array or a point cloud of Open3D"
FEWEST_ZEROS = 2  # rows (0, 0, 0) that are no points; a single one may be


def measured(points: np.ndarray, role: object, notes: list[str] | None = None) -> np.ndarray:
    """Return the rows (n, 3) without NaN or missing depth, (0, 0, 0), with a note on others; InputError for none."""
    infinite_N = ~np.isfinite(points).all(axis=1)
    zero_N = ~points.any(axis=1)
    zero_N &= zero_N.sum() >= FEWEST_ZEROS
    missing_N = infinite_N | zero_N
    if not (count := int(missing_N.sum())):
        return points
    kinds = {"(0, 0, 0)": zero_N, "NaN or infinite": infinite_N}
    why = f"{' or '.join(kind for kind, rows_N in kinds.items() if rows_N.any())}, as where depth is missing"
    if count == len(points):
        raise InputError(role, f"all of its {count} points are {why}", "save it again with its depths")
    if notes is not None:
        notes.append(f"{role}: {count} of {len(points)} points were left out: they are {why}")
    return points[~missing_N]


def as_points(cloud: Any, role: str, notes: list[str] | None = None) -> np.ndarray:
    """Return the measured points (n, 3) float64 of an array, a list, a tensor, or Open3D's cloud, not imported."""
    values = cloud
    if not isinstance(cloud, np.ndarray):
        if hasattr(cloud, "points"):  # of open3d.geometry.PointCloud, and of trimesh's scans
            values = cloud.points
        elif hasattr(cloud, "point"):  # a map of tensors, of open3d.t.geometry.PointCloud
            try:
                values = cloud.point["positions"]
            except (KeyError, TypeError, RuntimeError) as fault:
                raise InputError(role, f"is a {type(cloud).__name__} without positions", REMEDY) from fault
        elif hasattr(cloud, "vertices"):
            raise InputError(role, f"is a mesh ({type(cloud).__name__})", "sample points on it first")
        for name in ("detach", "cpu", "numpy"):  # of a tensor of torch or Open3D
            if (method := getattr(values, name, None)) is not None:
                values = method()
    try:
        points = np.asarray(values, np.float64)
    except (TypeError, ValueError) as fault:
        raise InputError(role, f"is a {type(cloud).__name__}, not a cloud of points", REMEDY) from fault
    if points.ndim != 2 or points.shape[1] != 3:
        advice = "transpose it" if points.ndim == 2 and points.shape[0] == 3 else REMEDY
        raise InputError(role, f"has the shape {points.shape}, not (N, 3)", advice)
    return measured(points, role, notes)
