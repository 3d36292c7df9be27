"""Meshes and clouds in a folder: PLY, OBJ, STL, OFF, VTK, glb; one file is one object."""

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from gpca.errors import InputError, refusing
from gpca.io.files import require_file
from gpca.objects import mesh_formats, scene_formats
from gpca.objects.canonical import require_points
from gpca.objects.surface import Surface, meters_per

READERS = {**mesh_formats.READERS, **scene_formats.READERS}
SUFFIXES = tuple(READERS)
WITHOUT_FACES = (".ply", ".vtk", ".glb")


def from_entry(entry: dict, folder: Path) -> Iterator[Surface]:
    """Return surfaces of a configured source: keys `files` (patterns, default all meshes of the folder) and `unit`."""
    scale = meters_per(entry.get("unit"))
    return (read_surface(path, scale) for path in files_in(folder, entry.get("files"), SUFFIXES))


def require_entry(entry: dict, folder: Path) -> None:
    """Raise an InputError unless the files that the entry names are there; reads none."""
    if entry.get("files"):
        files_in(folder, entry["files"], SUFFIXES)


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
    """Read one file, vertices times `scale`; without faces it is a cloud. Normals are used where all have a length."""
    remedy, suffix = "fetch or export it again", path.suffix.lower()
    require_file(path, "no such file", remedy)
    fault = f"is truncated or not a readable {path.suffix} file ({{}})"  # for which numpy raises errors of many kinds
    with refusing(path, fault, remedy), path.open("rb") as file, np.errstate(all="ignore"):  # overflows are found below
        vertices, faces, normals = READERS[suffix](file)
    if len(faces):
        require_points(vertices, path)
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise InputError(path, "a face refers to a missing vertex", remedy)
        return Surface(path.stem, vertices * scale, faces)
    if suffix not in WITHOUT_FACES:
        raise InputError(path, "has no faces", f"{remedy}, or give the points as PLY")
    require_points(vertices[np.isfinite(vertices).all(axis=1)], path)
    if normals is not None:
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        bad = int((~(lengths > 0)).sum())
        if bad:
            print(f"{path}: {bad} of {len(normals)} normals are zero or NaN, so none of them is used", file=sys.stderr)
        normals = None if bad else normals / lengths
    return Surface(path.stem, vertices * scale, None, normals)
