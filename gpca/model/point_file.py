"""A file of points or of a mesh as a user has it, read for one explanation; `SUFFIXES` says which formats."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from gpca.alignment.canonical_frame import CanonicalFrame, require_cloud_points
from gpca.alignment.rigid import require_rigid
from gpca.errors import InputError
from gpca.io.limits import require_file
from gpca.numerals import decimal
from gpca.objects import mesh_folder, point_files
from gpca.objects.canonical import bounding_center, canonical_cloud
from gpca.objects.surface import AS_OPTION

SAMPLED_POINTS = 16384  # so many are drawn on a mesh, as on the objects of the training
LARGEST_POSE_BYTES = 10**5  # 16 numbers, however they are written
OR_SCANS = f"{AS_OPTION} (scans of places: --scans)"  # since the limits of an object's size do not hold for those
SUFFIXES = (*mesh_folder.SUFFIXES, ".pcd", *point_files.TABLE_READERS, *point_files.PACKAGES)


def require_format(path: Path) -> None:
    """Raise an InputError unless there is a file to be read, of a format that :func:`read_points` reads."""
    require_file(path, "no such file", f"give one of {', '.join(SUFFIXES)}")
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(path, "has an unsupported format", f"give one of {', '.join(SUFFIXES)}")


def read_points(path: Path, unit: str) -> tuple[np.ndarray, CanonicalFrame]:
    """Return the points (N, 3) of a cloud, or drawn on a mesh, in the file's unit, and the frame that they span.

    Args:
        unit: the file's: ``m``, ``cm`` or ``mm``.

    Raises:
        InputError: no such file, another format, a package that is missing, unreadable, too few points, NaN, a mesh
            without area, or a diameter that this unit does not give.
    """
    scale = mesh_folder.meters_per(unit)
    require_format(path)
    if path.suffix.lower() in mesh_folder.SUFFIXES:
        surface = mesh_folder.read_surface(path, scale)
        if surface.faces is not None:
            points_m, _, diameter_m = canonical_cloud(surface, "mesh", SAMPLED_POINTS, OR_SCANS)
            frame = CanonicalFrame(bounding_center(surface) / scale, diameter_m / scale)
            return points_m.astype(np.float64) / scale + frame.center_3, frame
        points = surface.vertices_m / scale
    else:
        points = _cloud(path)
    return points, CanonicalFrame.of(points, unit, path, OR_SCANS)


def read_scan(path: Path) -> np.ndarray:
    """Return the points (N, 3) of a scan, or drawn on a mesh, in the file's unit, whatever their extent.

    Raises:
        InputError: as :func:`read_points`, but for the diameter.
    """
    require_format(path)
    if path.suffix.lower() not in mesh_folder.SUFFIXES:
        points = _cloud(path)
    else:
        surface = mesh_folder.read_surface(path, 1.0)
        points = surface.vertices_m
        if surface.faces is not None:  # drawn at a size that every mesh may have
            extent = float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0
            surface = replace(surface, vertices_m=points / extent)
            drawn, _, _ = canonical_cloud(surface, "mesh", SAMPLED_POINTS)
            points = extent * (drawn.astype(np.float64) + bounding_center(surface))
    require_cloud_points(points, path)
    return points


def _cloud(path: Path) -> np.ndarray:
    suffix = path.suffix.lower()
    if suffix == ".pcd":
        return point_files.parse_pcd(path.read_bytes(), path)
    if suffix in point_files.TABLE_READERS:
        return point_files.read_table(path)
    return point_files.read_scanner_file(path)


def read_pose(path: Path) -> np.ndarray:
    """Return the pose (4, 4) of a text file of 16 numbers, row by row.

    Raises:
        InputError: no such file, other than 16 numbers, or no rigid transform.
    """
    remedy = "give 4×4 numbers, row by row"
    require_file(path, "no such file", remedy, LARGEST_POSE_BYTES)
    try:
        numbers = [decimal(word) for word in path.read_text(encoding="utf-8").replace(",", " ").split()]
    except ValueError as fault:
        raise InputError(path, f"contains something that is not a number: {fault}", remedy) from fault
    if len(numbers) != 16:
        raise InputError(path, f"contains {len(numbers)} numbers", remedy)
    T_target_source = np.array(numbers).reshape(4, 4)
    require_rigid(T_target_source, path)
    return T_target_source
