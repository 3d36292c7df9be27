"""Meshes and clouds in a folder: PLY, OBJ, STL, OFF; one file is one object.

trimesh reads rows that are too wide, lists of another length, misspelled keywords or a file that ends early as another
mesh, without a word; so files of text are first checked to hold what they declare.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import IO

import numpy as np

from gpca.errors import InputError, refusing
from gpca.io.files import require_file
from gpca.numerals import decimal
from gpca.objects.canonical import require_points
from gpca.objects.surface import Surface, meters_per

SUFFIXES = (".ply", ".obj", ".stl", ".off")


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
    # A malformed file makes the parsers raise nearly anything.
    with refusing(path, f"is truncated or not a readable {path.suffix} file ({{}})", remedy):
        with path.open("rb") as file:
            CHECKS[suffix](file)
        import trimesh

        # Unprocessed: processing would drop NaN vertices and merge others in silence.
        with np.errstate(all="ignore"):  # overflows are found below
            loaded = trimesh.load(path, process=False, skip_materials=True, fix_texture=False)
        if isinstance(loaded, trimesh.Scene) and loaded.geometry:  # an OBJ with several materials
            loaded = loaded.to_mesh()
        raw = getattr(loaded, "metadata", {}).get("_ply_raw", {})
        for name, data in ((name, element.get("data")) for name, element in raw.items()):
            for field in (isinstance(data, np.ndarray) and data.dtype.names) or ():
                if data.dtype[field].names:
                    lengths = data[field]["f0"]  # of lists, all of which trimesh reads like the first
                    if (lengths != lengths[:1]).any():
                        raise ValueError(f"lists of element {name} differ in length")
                    if field.encode() in CORNERS and (lengths < 3).any():
                        raise ValueError(f"element {name} has rows of {lengths[0]} corners")
    vertices = np.asarray(getattr(loaded, "vertices", np.zeros((0, 3))), dtype=np.float64)
    faces = np.asarray(getattr(loaded, "faces", np.zeros((0, 3))), dtype=np.int64)
    require_points(vertices, path)
    if len(faces):
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise InputError(path, "a face refers to a missing vertex", remedy)
        return Surface(path.stem, vertices * scale, faces)
    if suffix != ".ply":
        raise InputError(path, "has no faces", f"{remedy}, or give the points as PLY")
    axes, normals = ("nx", "ny", "nz"), None
    if set(axes) <= set(raw["vertex"]["properties"]):  # the only place where trimesh keeps a cloud's normals
        normals = np.column_stack([np.ravel(raw["vertex"]["data"][axis]) for axis in axes]).astype(np.float64)
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        if not (lengths > 0).all():
            raise InputError(path, "a normal is zero or NaN", "export it again with its normals or without any")
        normals /= lengths
    return Surface(path.stem, vertices * scale, None, normals)


OFF_VERTEX_COLUMNS = (3, 6, 7)  # coordinates, alone or with a color
OFF_COLOR_COLUMNS = (0, 1, 3, 4)  # of a face
OBJ_VERTEX_COLUMNS = (3, 4, 6, 7)  # coordinates, alone, with a weight, with a color, with both
# Exporters write the vertices that their faces use. A file that ends early leaves more unused than a modeler does; an
# OBJ states its number of faces in no other way.
LARGEST_UNUSED_SHARE = 0.1
# Text takes a hundred times as long to parse as numbers in binary. A scan of a million triangles has 80 MB of text.
LARGEST_TEXT_BYTES = 250 * 10**6
LONGEST_LINE = 2**20  # bytes; a file with longer ones is not text
CORNERS = (b"vertex_index", b"vertex_indices")  # names of the corners of a face in PLY
PLY_FORMATS = (b"ascii", b"binary_little_endian", b"binary_big_endian")
# The keywords of the lines of a facet, and how many numbers follow.
STL_FACET = ((b"facet normal", 3), (b"outer loop", 0), *[(b"vertex", 3)] * 3, (b"endloop", 0), (b"endfacet", 0))
STL_HEAD_BYTES, STL_FACET_BYTES = 84, 50  # of binary STL; the head ends with the number of facets


def _check_ply(file: IO[bytes]) -> None:
    is_text, elements = _ply_header(file)
    if not is_text:
        return
    rows = (row.split() for row in _lines(file) if row.strip())
    for name, count, properties in elements:
        for i in range(count):
            row, place, subject = next(rows, None), 0, f"row {i + 1} of {count} of element {name}"
            if row is None:
                raise ValueError(f"{subject} is missing")
            for words in properties:
                if words[1] == b"list" and place < len(row):
                    length = _count(row[place])
                    if words[-1] in CORNERS:
                        if length < 3:
                            raise ValueError(f"{subject} has {length} corners")
                        if not all(word.isdigit() for word in row[place + 1 : place + 1 + length]):
                            raise ValueError(f"{subject} has a corner that is not a number of a vertex")
                    place += length
                place += 1
            if place != len(row):
                raise ValueError(f"{subject} does not match its header")
    if next(rows, None) is not None:
        raise ValueError("more rows than the header states")


def _ply_header(file: IO[bytes]) -> tuple[bool, list[tuple[str, int, list[list[bytes]]]]]:
    """Return whether the data are text, and name, count and properties of each element."""
    elements: dict[str, tuple[str, int, list[list[bytes]]]] = {}
    form = b""
    lines = _bounded_lines(file)
    if next(lines, b"").strip() != b"ply":
        raise ValueError("it does not begin with 'ply'")
    properties: list[list[bytes]] | None = None
    for line in lines:
        match line.split():
            case [b"end_header", *_]:
                if form not in PLY_FORMATS:
                    raise ValueError(f"its format {_shown(form)} is unknown")
                return form == b"ascii", list(elements.values())
            case [b"format", form, *_]:
                pass
            case [b"element", word, count, *_]:
                if (name := word.decode("ascii", "replace")) in elements:
                    raise ValueError(f"its header declares element {name} twice")
                properties = []
                elements[name] = (name, _count(count), properties)
            case [b"property", _, *_, word] as words if properties is not None:
                if word in (before[-1] for before in properties):
                    raise ValueError(f"its header declares property {_shown(word)} twice in one element")
                properties.append(words)
            case [b"format" | b"element" | b"property", *_]:
                raise ValueError(f"its header contains {_shown(line.strip())}")
    raise ValueError("its header has no end")


def _check_off(file: IO[bytes]) -> None:
    rows = (words for words in (line.split(b"#")[0].split() for line in _lines(file)) if words)
    head = next(rows, [b""])
    # The counts may stand in the line of the word OFF or COFF, even without a space.
    counts = [word for word in (head[0].lstrip(b"COF"), *head[1:]) if word] or next(rows, [])
    vertices, faces = (_count(word) for word in counts[:2])
    for i in range(vertices):
        if len(row := next(rows, [])) not in OFF_VERTEX_COLUMNS:
            raise ValueError(f"vertex {i + 1} of {vertices} is missing or does not have 3 coordinates")
        for word in row:  # of the formats of text, trimesh reads this one by Python's float()
            decimal(word.decode("utf-8", "replace"))
    for i in range(faces):
        row = next(rows, [b"0"])
        corners = _count(row[0])
        whole = len(row) - 1 - corners in OFF_COLOR_COLUMNS and all(word.isdigit() for word in row[1 : 1 + corners])
        if 0 < corners < 3:
            raise ValueError(f"face {i + 1} of {faces} has {corners} corners")
        if not corners or not whole:
            raise ValueError(f"face {i + 1} of {faces} is missing or does not have its stated length")
    if next(rows, None) is not None:
        raise ValueError("more rows than it declares")


def _check_obj(file: IO[bytes]) -> None:
    vertices, relative_at, others, before = 0, -1, False, b""
    used: set[int] = set()
    for number, line in enumerate(_lines(file), start=1):
        line = before + line.split(b"#")[0].rstrip()
        before = line[:-1] + b" " if line.endswith(b"\\") else b""  # it continues in the next line
        if before or not line.strip():
            continue
        keyword, *words = line.split()
        if keyword == b"v":
            vertices += 1
            if len(words) not in OBJ_VERTEX_COLUMNS or (len(words) == 4 and float(words[3]) != 1):
                raise ValueError(f"line {number}: a vertex has {len(words)} numbers or a weight other than 1")
        elif keyword == b"f":
            corners = [int(word.split(b"/")[0]) for word in words]
            if len(corners) < 3 or 0 in corners:
                raise ValueError(f"line {number}: a face has {len(corners)} corners or refers to vertex 0")
            if min(corners) < 0:
                relative_at = vertices
            used.update(corner if corner > 0 else vertices + 1 + corner for corner in corners)
        others |= keyword in (b"l", b"p")  # lines and points use vertices, too
    if not used:
        raise InputError(file.name, "has no faces", "export it again, or give the points as PLY")
    if min(used) < 1 or max(used) > vertices:
        raise ValueError("a face refers to a missing vertex")
    if relative_at not in (-1, vertices):
        raise ValueError("faces use relative numbers before the last vertex; export it with absolute numbers")
    if not others and len(used) < (1 - LARGEST_UNUSED_SHARE) * vertices:
        raise ValueError(f"{vertices - len(used)} of {vertices} vertices belong to no face, as in a truncated file")


def _check_stl(file: IO[bytes]) -> None:
    head, size = file.read(STL_HEAD_BYTES), file.seek(0, os.SEEK_END)
    if size == STL_HEAD_BYTES + STL_FACET_BYTES * int.from_bytes(head[80:], "little"):
        return
    if not head.lstrip().lower().startswith(b"solid"):
        raise ValueError("it neither begins with 'solid' nor has the length that its number of facets needs")
    file.seek(0)
    place, keyword = 0, b"solid"  # within the facet, and of the line before
    for number, line in enumerate(_lines(file), start=1):
        words = line.lower().split()
        if not words:
            continue
        if place == 0 and words[0] in (b"solid", b"endsolid"):
            keyword = words[0]
            continue
        keyword, wanted = STL_FACET[place]
        length = len(keyword.split())
        if (written := b" ".join(words[:length])) != keyword:
            raise ValueError(f"line {number}: {_shown(written)} stands where {_shown(keyword)} should")
        if (numbers := len(words) - length) != wanted:
            raise ValueError(f"line {number}: {_shown(keyword)} has {numbers} numbers")
        place = (place + 1) % len(STL_FACET)
    if keyword != b"endsolid":
        raise ValueError("it ends before 'endsolid'")


# They check that a text file holds what it declares; of a binary PLY, only the header. ValueError where it does not.
CHECKS: dict[str, Callable[[IO[bytes]], None]] = dict(
    zip(SUFFIXES, (_check_ply, _check_obj, _check_stl, _check_off), strict=True)
)


def _lines(file: IO[bytes]) -> Iterator[bytes]:
    """Yield the remaining lines of a text file; InputError where it has too much text to parse."""
    if (size := os.fstat(file.fileno()).st_size) > LARGEST_TEXT_BYTES:
        fault = f"has {size / 1e6:.0f} MB of text, more than the limit of {LARGEST_TEXT_BYTES / 1e6:.0f} MB"
        raise InputError(file.name, fault, "export it as binary PLY, or with fewer faces")
    yield from _bounded_lines(file)


def _bounded_lines(file: IO[bytes]) -> Iterator[bytes]:
    while line := file.readline(LONGEST_LINE):
        if len(line) == LONGEST_LINE:
            raise ValueError(f"a line is longer than {LONGEST_LINE} bytes, so it is not text")
        yield line


def _count(word: bytes) -> int:
    if not word.isdigit():
        raise ValueError(f"{_shown(word)} is not a count")
    return int(word)


def _shown(word: bytes) -> str:
    return f"'{word[:40].decode('ascii', 'replace')}'"
