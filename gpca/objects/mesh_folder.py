"""Meshes and clouds in a folder: PLY, OBJ, STL, OFF; one file is one object."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.objects.canonical import require_points
from gpca.objects.surface import Surface

SUFFIXES = (".ply", ".obj", ".stl", ".off")
METRES_PER_UNIT = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}


def from_entry(entry: dict, folder: Path) -> Iterator[Surface]:
    """Surfaces of a configured source: keys `files` (patterns, default every mesh of the folder) and `unit`."""
    return surfaces(files_in(folder, entry.get("files"), SUFFIXES), entry.get("unit"))


def surfaces(paths: Iterable[Path], unit: str | None) -> Iterator[Surface]:
    """Yield one surface per file, named by the file's stem."""
    scale = metres_per(unit)
    for path in paths:
        yield read_surface(path, scale)


def metres_per(unit: str | None) -> float:
    """Metres in one `unit`; InputError for a unit other than m, cm, mm."""
    if unit not in METRES_PER_UNIT:
        raise InputError(f"unit '{unit}'", "is not a known unit of length", "set unit: m, cm or mm")
    return METRES_PER_UNIT[unit]


def files_in(folder: str | Path, patterns: Sequence[str] | None, suffixes: Sequence[str]) -> list[Path]:
    """Files of a folder, sorted: those that the glob patterns name, or else all with one of the suffixes.

    Raises:
        InputError: no such folder, an empty one, a pattern without a match, a match of another format.
    """
    folder = Path(folder)
    formats = ", ".join(suffixes)
    if not folder.is_dir():
        raise InputError(folder, "no such folder", "check location and data_dir in the config")
    if patterns is None:
        found = {path for path in folder.iterdir() if path.name.lower().endswith(tuple(suffixes))}
        if not found:
            raise InputError(folder, f"the folder holds none of {formats}", "check location, or set files")
        return sorted(found)
    found = set()
    for pattern in patterns:
        matches = {path for path in folder.glob(pattern) if path.is_file()}
        if not matches:
            raise InputError(folder / pattern, "no file matches", "check files in the config")
        found |= matches
    for path in sorted(found):
        if not path.name.lower().endswith(tuple(suffixes)):
            raise InputError(path, "is of another format", f"let files match only {formats}")
    return sorted(found)


def read_surface(path: Path, scale: float) -> Surface:
    """Read one file, vertices times `scale`. Points without faces are a cloud, which only PLY may hold.

    Raises:
        InputError: unreadable, truncated, without points or faces, NaN, or faces that name no vertex.
    """
    import trimesh

    remedy = "fetch or export it anew"
    try:
        # Unprocessed: processing would drop NaN vertices and merge others in silence.
        loaded = trimesh.load(path, process=False, skip_materials=True, fix_texture=False)
        if isinstance(loaded, trimesh.Scene) and loaded.geometry:  # an OBJ with several materials
            loaded = loaded.to_mesh()
        _require_whole(path)
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
        raise InputError(path, "a face names a vertex that is not there", remedy)
    return Surface(path.stem, vertices * scale, faces)


def _cloud_normals(cloud, path: Path) -> np.ndarray | None:
    """Unit normals that the PLY of a point cloud carries; None when it has none."""
    vertex = cloud.metadata["_ply_raw"]["vertex"]  # the only place where trimesh keeps a cloud's normals
    axes = ("nx", "ny", "nz")
    if not set(axes) <= set(vertex["properties"]):
        return None
    normals = np.column_stack([np.ravel(vertex["data"][axis]) for axis in axes]).astype(np.float64)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    if not (lengths > 0).all():
        raise InputError(path, "a normal is zero or NaN", "export it anew, with its normals or without any")
    return normals / lengths


def _require_whole(path: Path) -> None:
    """Raise ValueError for an OFF or ASCII PLY that ends before the rows that it declares.

    trimesh reads such a file as a smaller mesh, without a word; in a binary PLY it checks the length itself.
    """
    if path.suffix.lower() == ".off":
        declared, rows, columns, is_list = _off_rows(path.read_bytes())
    elif path.suffix.lower() == ".ply":
        declared, rows, columns, is_list = _ply_rows(path.read_bytes())
    else:
        return
    if len(rows) < declared:
        raise ValueError(f"{len(rows)} of {declared} declared vertices and faces")
    if declared:
        last = rows[declared - 1].split()  # a list, as of a face's vertices, says itself how long it is
        if len(last) < columns + (int(last[0]) if is_list else 0):
            raise ValueError("its last row is incomplete")


def _off_rows(content: bytes) -> tuple[int, list[bytes], int, bool]:
    """Return declared rows, the rows, least columns of the last one, and whether it begins with a list's length."""
    rows = [row for row in (line.split(b"#")[0].strip() for line in content.splitlines()) if row]
    counts, rows = (rows[1], rows[2:]) if rows[0].isalpha() else (rows[0][3:], rows[1:])  # OFF may share their line
    vertices, faces = map(int, counts.split()[:2])
    return vertices + faces, rows, 1 if faces else 3, faces > 0


def _ply_rows(content: bytes) -> tuple[int, list[bytes], int, bool]:
    """Return the same for an ASCII PLY; a binary one has no rows."""
    header, _, body = content.partition(b"end_header")
    if b"format ascii" not in header:
        return 0, [], 0, False
    elements = [element.splitlines() for element in header.split(b"\nelement ")[1:]]
    properties = [line for line in elements[-1][1:] if line.startswith(b"property")]
    rows = [row for row in body.splitlines() if row.strip()]
    declared = sum(int(element[0].split()[1]) for element in elements)
    return declared, rows, len(properties), properties[0].startswith(b"property list")
