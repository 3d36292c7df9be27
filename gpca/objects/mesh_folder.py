"""Meshes and clouds in a folder: PLY, OBJ, STL, OFF, legacy VTK (PolyData 1 to 5), and, by trimesh, glb 2.0."""

import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO

import numpy as np

from gpca.errors import InputError, refusing
from gpca.io.files import require_file
from gpca.objects import mesh_formats
from gpca.objects.canonical import require_points
from gpca.objects.mesh_formats import Shape, as_count, as_triangles, bounded_lines, quoted, text_lines
from gpca.objects.surface import Surface, meters_per

VTK_KINDS = {
    **{b"float": "f4", b"double": "f8", b"int": "i4", b"unsigned_int": "u4", b"vtktypeint64": "i8", b"vtkidtype": "i4"},
    **{b"short": "i2", b"unsigned_short": "u2", b"char": "i1", b"unsigned_char": "u1"},
    **{b"long": "i8", b"unsigned_long": "u8"},
}
VTK_CELLS = (b"VERTICES", b"LINES", b"POLYGONS", b"TRIANGLE_STRIPS")


class _VTK:
    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        if not self.line().startswith(b"# vtk DataFile"):
            raise ValueError("it does not begin with '# vtk DataFile'")
        self.line()  # the title
        form = self.line().strip().upper()
        if form not in (b"ASCII", b"BINARY"):
            raise ValueError(f"its format {quoted(form)} is unknown")
        self._lines = text_lines(file) if form == b"ASCII" else None

    def line(self) -> bytes:
        return next(bounded_lines(self._file), b"")

    def words(self) -> list[bytes]:
        """Return the words of the next line that is not blank; none at the end."""
        while (line := self.line()) and not line.strip():
            pass
        return line.split()

    def numbers(self, kind: bytes, count: int) -> np.ndarray:
        dtype = np.dtype(VTK_KINDS[kind.lower()])
        if self._lines is None:
            if count * dtype.itemsize > os.fstat(self._file.fileno()).st_size:
                raise ValueError(f"it states {count} numbers, more than it can hold")
            return np.frombuffer(self._file.read(count * dtype.itemsize), dtype.newbyteorder(">"), count)
        words: list[bytes] = []
        while len(words) < count and (line := next(self._lines, b"")):
            words += line.split()
        if len(words) != count:
            raise ValueError(f"{len(words)} numbers stand where {count} should")
        return np.loadtxt(words, np.int64 if dtype.kind in "iu" else np.float64, comments=None, ndmin=1)

    def cells(self, count: int, size: int) -> np.ndarray | list:
        """Return the corners of each cell: an array (count, corners) if all have as many."""
        place = self._file.tell()
        if (words := self.words())[:1] == [b"OFFSETS"]:  # as of version 5
            offsets = self.numbers(words[1], count)
            kind = self.words()[-1]
            corners, lengths = self.numbers(kind, size), np.diff(offsets)
        else:
            self._file.seek(place)
            flat = self.numbers(b"int", size)
            numbers, starts = flat.tolist(), [0] if size else []
            while starts and numbers[starts[-1]] >= 0 and (following := starts[-1] + numbers[starts[-1]] + 1) < size:
                starts.append(following)
            if len(starts) != count:
                raise ValueError(f"{len(starts)} cells stand where {count} should")
            lengths, corners = flat[starts], np.delete(flat, starts)
        if lengths.sum() != len(corners) or (lengths < 0).any():
            raise ValueError("its cells do not have the length that it states")
        if len(lengths) and (lengths == lengths[0]).all():
            return corners.reshape(len(lengths), -1)
        return [cell.tolist() for cell in np.split(corners, np.cumsum(lengths)[:-1])] if len(lengths) else []


def _read_vtk(file: IO[bytes]) -> Shape:
    vtk = _VTK(file)
    dataset = vtk.words()
    if [word.upper() for word in dataset] != [b"DATASET", b"POLYDATA"]:
        raise ValueError(f"it holds {quoted(b' '.join(dataset))}, not 'DATASET POLYDATA'")
    vertices, faces = np.zeros((0, 3)), np.zeros((0, 3), np.int64)
    while words := vtk.words():
        match words[0].upper(), *words[1:]:
            case [b"POINTS", count, kind]:
                vertices = vtk.numbers(kind, 3 * as_count(count)).reshape(-1, 3).astype(np.float64)
            case [word, count, size] if word in VTK_CELLS:
                cells = vtk.cells(as_count(count), as_count(size))
                if word == b"TRIANGLE_STRIPS":
                    raise ValueError("it has triangle strips; export it as triangles")
                if word == b"POLYGONS" and len(cells):
                    if min(map(len, cells)) < 3:
                        raise ValueError("a polygon has fewer than 3 corners")
                    faces = as_triangles(cells)
            case [b"METADATA", *_]:  # up to a blank line
                while (line := vtk.line()).strip():
                    pass
                if not line:
                    raise ValueError("it ends within its metadata")
            case [b"FIELD", _, arrays]:
                for _ in range(as_count(arrays)):
                    _, width, rows, kind = vtk.words()
                    vtk.numbers(kind, as_count(width) * as_count(rows))
            case [b"POINT_DATA" | b"CELL_DATA", *_]:
                break
            case _:
                raise ValueError(f"{quoted(b' '.join(words))} is unknown")
    return Shape(vertices, faces)


def _read_glb(file: IO[bytes]) -> Shape:
    import trimesh

    vertices, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], 0
    for part in trimesh.load_scene(file, file_type="glb", process=False).dump():
        if isinstance(part, trimesh.Trimesh | trimesh.PointCloud):
            faces.append(count + np.asarray(getattr(part, "faces", faces[0])))
            vertices.append(np.asarray(part.vertices))
            count += len(part.vertices)
    return Shape(np.concatenate(vertices), np.concatenate(faces))


READERS = {**mesh_formats.READERS, ".vtk": _read_vtk, ".glb": _read_glb}
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
