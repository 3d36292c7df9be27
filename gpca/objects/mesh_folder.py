"""Meshes and clouds in a folder: PLY, OBJ, STL, OFF; one file is one object."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.io.limits import require_file
from gpca.objects.canonical import require_points
from gpca.objects.mesh_text import CORNERS, require_whole
from gpca.objects.surface import Surface

SUFFIXES = (".ply", ".obj", ".stl", ".off")
METERS_PER_UNIT = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}


def from_entry(entry: dict, folder: Path) -> Iterator[Surface]:
    """Return surfaces of a configured source: keys `files` (patterns, default every mesh of the folder) and `unit`."""
    return surfaces(files_in(folder, entry.get("files"), SUFFIXES), entry.get("unit"))


def surfaces(paths: Iterable[Path], unit: str | None) -> Iterator[Surface]:
    """Yield one surface per file, named by the file's stem."""
    scale = meters_per(unit)
    for path in paths:
        yield read_surface(path, scale)


def meters_per(unit: str | None) -> float:
    """Return the meters in one `unit`; InputError for a unit other than m, cm, mm."""
    if unit not in METERS_PER_UNIT:
        raise InputError(f"unit '{unit}'", "is not a known unit of length", "set unit: m, cm or mm")
    return METERS_PER_UNIT[unit]


def files_in(folder: str | Path, patterns: Sequence[str] | None, suffixes: Sequence[str]) -> list[Path]:
    """Return the files of a folder, sorted: those that the glob patterns name, or else all with one of the suffixes.

    Raises:
        InputError: no such folder, an empty one, a pattern without a match, a match of another format.
    """
    folder = Path(folder)
    formats = ", ".join(suffixes)
    if not folder.is_dir():
        raise InputError(folder, "no such folder", "check location and data_dir in the config")
    if patterns is None:
        files = {path for path in folder.iterdir() if path.name.lower().endswith(tuple(suffixes))}
        if not files:
            raise InputError(folder, f"the folder has none of {formats}", "check location, or set files")
        return sorted(files)
    files = set()
    for pattern in patterns:
        matches = {path for path in folder.glob(pattern) if path.is_file()}
        if not matches:
            raise InputError(folder / pattern, "no file matches", "check files in the config")
        files |= matches
    for path in sorted(files):
        if not path.name.lower().endswith(tuple(suffixes)):
            raise InputError(path, "has an unsupported format", f"let files match {formats} only")
    return sorted(files)


def read_surface(path: Path, scale: float) -> Surface:
    """Read one file, vertices times `scale`. Points without faces are a cloud, which only PLY may hold.

    Raises:
        InputError: unreadable, too large, truncated or longer than it declares, without points or faces, NaN, or faces
            that name no vertex.
    """
    remedy = "fetch or export it again"
    require_file(path, "no such file", remedy)
    try:
        require_whole(path)
        import trimesh  # here, since a file that is refused above needs none of it

        # Unprocessed: processing would drop NaN vertices and merge others in silence.
        with np.errstate(all="ignore"):  # numbers that overflow are found below
            loaded = trimesh.load(path, process=False, skip_materials=True, fix_texture=False)
        if isinstance(loaded, trimesh.Scene) and loaded.geometry:  # an OBJ with several materials
            loaded = loaded.to_mesh()
        _require_equal_lists(loaded)
    except InputError:
        raise
    except Exception as fault:  # a malformed file makes the parsers raise nearly anything
        raise InputError(path, f"is truncated or not a readable {path.suffix} file ({fault})", remedy) from fault
    vertices = np.asarray(getattr(loaded, "vertices", np.zeros((0, 3))), dtype=np.float64)
    faces = np.asarray(getattr(loaded, "faces", np.zeros((0, 3))), dtype=np.int64)
    require_points(vertices, path)
    if len(faces) == 0:
        if path.suffix.lower() != ".ply":
            raise InputError(path, "has no faces", f"{remedy}, or give the points as PLY")
        return Surface(path.stem, vertices * scale, None, _cloud_normals(loaded, path))
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError(path, "a face refers to a missing vertex", remedy)
    return Surface(path.stem, vertices * scale, faces)


def _cloud_normals(cloud, path: Path) -> np.ndarray | None:
    """Return the unit normals that the PLY of a point cloud carries; None when it has none."""
    vertex = cloud.metadata["_ply_raw"]["vertex"]  # the only place where trimesh keeps a cloud's normals
    axes = ("nx", "ny", "nz")
    if not set(axes) <= set(vertex["properties"]):
        return None
    normals = np.column_stack([np.ravel(vertex["data"][axis]) for axis in axes]).astype(np.float64)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    if not (lengths > 0).all():
        raise InputError(path, "a normal is zero or NaN", "export it again with its normals or without any")
    return normals / lengths


def _require_equal_lists(loaded) -> None:
    """Raise a ValueError where a list of a binary PLY differs in length from the first: trimesh reads all like that."""
    raw = getattr(loaded, "metadata", {}).get("_ply_raw", {})
    for name, element in raw.items():
        data = element.get("data")
        for field in (isinstance(data, np.ndarray) and data.dtype.names) or ():
            if not data.dtype[field].names:
                continue
            lengths = data[field]["f0"]
            if (lengths != lengths[:1]).any():
                raise ValueError(f"lists of element {name} differ in length")
            if field.encode() in CORNERS and (lengths < 3).any():
                raise ValueError(f"element {name} has rows of {lengths[0]} corners")
