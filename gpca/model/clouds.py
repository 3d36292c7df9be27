"""The clouds of a user's registration: read from files, checked, thinned and brought into the target's frame."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.alignment.rigid import require_rigid, transform
from gpca.errors import InputError
from gpca.io.limits import require_file
from gpca.numerals import decimal
from gpca.objects import mesh_folder, point_files
from gpca.objects.canonical import bounding_center, canonical_cloud, normals_towards_camera
from gpca.objects.canonical_frame import CanonicalFrame, require_cloud_points, thin
from gpca.objects.surface import AS_ARGUMENT, AS_OPTION, as_points

if TYPE_CHECKING:
    from gpca.alignment.batched_icp import BatchedICP

SAMPLED_POINTS = 16384  # points sampled on a mesh, as on the training objects
LARGEST_POSE_BYTES = 10**5  # 16 numbers in any notation
SUFFIXES = (*mesh_folder.SUFFIXES, ".pcd", *point_files.TABLE_READERS, *point_files.PACKAGES)
# Remedies for a wrong size: scans of places have no limits of size.
OR_SCANS_OPTION = f"{AS_OPTION} (scans of places: --scans)"
OR_SCANS = f"{AS_ARGUMENT} (scans of places: gpca.explain_scans)"
LARGEST_RATIO = 8.0  # between the extents of source and target; a wrong unit gives 10 or more
FARTHEST_START = 10.0  # largest distance from the target's center to the source, in diameters of the target


def require_format(path: Path) -> None:
    """Raise an InputError unless the file exists and :func:`read_points` knows its format."""
    require_file(path, "no such file", f"give one of {', '.join(SUFFIXES)}")
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(path, "has an unsupported format", f"give one of {', '.join(SUFFIXES)}")


def read_points(path: Path, unit: str) -> tuple[np.ndarray, CanonicalFrame]:
    """Read a cloud, or sample a mesh.

    Args:
        unit: the file's: ``m``, ``cm`` or ``mm``.

    Returns:
        Points (N, 3) in that unit, and their canonical frame.

    Raises:
        InputError: missing or unreadable file, unsupported format, missing package, too few points, NaN, a mesh without
            area, or a diameter out of range.
    """
    scale = mesh_folder.meters_per(unit)
    require_format(path)
    if path.suffix.lower() in mesh_folder.SUFFIXES:
        surface = mesh_folder.read_surface(path, scale)
        if surface.faces is not None:
            points_m, _, diameter_m = canonical_cloud(surface, "mesh", SAMPLED_POINTS, OR_SCANS_OPTION)
            frame = CanonicalFrame(bounding_center(surface) / scale, diameter_m / scale)
            return points_m.astype(np.float64) / scale + frame.center_3, frame
        points = surface.vertices_m / scale
    else:
        points = _cloud(path)
    return points, CanonicalFrame.of(points, unit, path, OR_SCANS_OPTION)


def read_scan(path: Path) -> np.ndarray:
    """Read a scan of any extent, or sample a mesh: points (N, 3) in the file's unit.

    Raises:
        InputError: as :func:`read_points`, except for the diameter.
    """
    require_format(path)
    if path.suffix.lower() not in mesh_folder.SUFFIXES:
        points = _cloud(path)
    else:
        surface = mesh_folder.read_surface(path, 1.0)
        points = surface.vertices_m
        if surface.faces is not None:  # sampled at unit extent, because sampling limits the size of meshes
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
    """Read a pose (4, 4) from a text file of 16 numbers, row by row.

    Raises:
        InputError: missing file, wrong number of numbers, not a rigid transform.
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


@dataclass(frozen=True)
class Clouds:
    """The two clouds of a registration, and its ICP.

    Attributes:
        seen: (N, 3) the given source, thinned.
        T_target_source_init: initial pose of ICP, in the user's unit.
        frame: canonical frame of the target.
        source, target: (N, 3) and (P, 3) in that frame, the source at its initial pose.
        icp: ICP to that target.
    """

    seen: np.ndarray
    T_target_source_init: np.ndarray
    frame: CanonicalFrame
    source: np.ndarray
    target: np.ndarray
    icp: BatchedICP

    @classmethod
    def prepared(
        cls,
        source_points: np.ndarray,
        target_points: np.ndarray,
        T_target_source_init: np.ndarray | None,
        unit: str,
        frame: CanonicalFrame | None,
        cloud_points: int,
        settings: ICPSettings,
        notes: list[str],
    ) -> Clouds:
        """Check a user's clouds and bring them into the target's frame; see :meth:`gpca.Explainer.explain`.

        Args:
            cloud_points: maximum number of points per cloud.
            settings: of ICP.
            notes: receives a note on each cloud that was thinned.
        """
        from gpca.alignment.batched_icp import BatchedICP

        source, target = as_points(source_points, "source"), as_points(target_points, "target")
        T_init = np.eye(4) if T_target_source_init is None else np.array(T_target_source_init, np.float64)
        require_rigid(T_init, "initial pose")
        require_cloud_points(source, "source")
        frame = frame or CanonicalFrame.of(target, unit, say=OR_SCANS)
        target = frame.coordinates(_thinned(target, cloud_points, "target", notes))
        seen = _thinned(source, cloud_points, "source", notes)
        source = frame.coordinates(transform(T_init, seen))
        distance = float(np.linalg.norm(source, axis=1).min())
        if T_target_source_init is not None and distance > FARTHEST_START:
            fault = f"puts the source {distance:.3g} diameters of the target away from it"
            raise InputError("initial pose", fault, f"give T_target_source, with its translation in {unit}")
        extents = [float(np.linalg.norm(np.ptp(cloud, axis=0))) for cloud in (source, target)]
        ratio = extents[0] / extents[1]
        if not 1 / LARGEST_RATIO <= ratio <= LARGEST_RATIO:
            remedy = "give both in the same unit, without points far from the object"
            raise InputError("source", f"is {ratio:.3g} times as large as the target", remedy)
        normals = None if settings.method == "point_to_point" else normals_towards_camera(target)
        return cls(seen, T_init, frame, source, target, BatchedICP(target, settings, normals))


def _thinned(points: np.ndarray, cloud_points: int, role: str, notes: list[str]) -> np.ndarray:
    kept = thin(points, cloud_points, role)
    if len(kept) < len(points):
        notes.append(f"{role}: {len(kept)} of {len(points)} points, drawn at random")
    return kept
