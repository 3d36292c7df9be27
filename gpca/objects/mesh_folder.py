"""Meshes and clouds in a folder: PLY, OBJ, STL, OFF; one file is one object."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from gpca.errors import InputError, refusing
from gpca.io.files import require_file
from gpca.objects.canonical import require_points
from gpca.objects.mesh_formats import READERS
from gpca.objects.surface import Surface, meters_per

SUFFIXES = tuple(READERS)


def from_entry(entry: dict, folder: Path) -> Iterator[Surface]:
    """Return surfaces of a configured source: keys `files` (patterns, default all meshes of the folder) and `unit`."""
    scale = meters_per(entry.get("unit"))
    return (read_surface(path, scale) for path in files_in(folder, entry.get("files"), SUFFIXES))


def files_in(folder: str | Path, patterns: Sequence[str] | None, suffixes: Sequence[str]) -> list[Path]:
    """Return the files of a folder, sorted: the matches of the patterns, or all with one of the suffixes."""
    folder, formats = Path(folder), ", ".join(suffixes)
    if not folder.is_dir():
        raise InputError(folder, "no such folder", "check location and data_dir in the config")
    matches = {pattern: {path for path in folder.glob(pattern) if path.is_file()} for pattern in patterns or ()}
    if none := [pattern for pattern, files in matches.items() if not files]:
        raise InputError(folder / none[0], "no file matches", "check files in the config")
    paths = sorted(folder.iterdir() if patterns is None else set().union(*matches.values()))
    files = [path for path in paths if path.name.lower().endswith(tuple(suffixes))]
    if patterns is not None and (others := [path for path in paths if path not in files]):
        raise InputError(others[0], "has an unsupported format", f"let files match {formats} only")
    if not files:
        raise InputError(folder, f"the folder has none of {formats}", "check location, or set files")
    return files


def read_surface(path: Path, scale: float) -> Surface:
    """Read one file, vertices times `scale`. Points without faces are a cloud, which only PLY may hold."""
    remedy, suffix = "fetch or export it again", path.suffix.lower()
    require_file(path, "no such file", remedy)
    fault = f"is truncated or not a readable {path.suffix} file ({{}})"  # for which numpy raises errors of many kinds
    with refusing(path, fault, remedy), path.open("rb") as file, np.errstate(all="ignore"):  # overflows are found below
        vertices, faces, normals = READERS[suffix](file)
    require_points(vertices, path)
    if len(faces):
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise InputError(path, "a face refers to a missing vertex", remedy)
        return Surface(path.stem, vertices * scale, faces)
    if suffix != ".ply":
        raise InputError(path, "has no faces", f"{remedy}, or give the points as PLY")
    if normals is not None:
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        if not (lengths > 0).all():
            raise InputError(path, "a normal is zero or NaN", "export it again with its normals or without any")
        normals = normals / lengths
    return Surface(path.stem, vertices * scale, None, normals)
