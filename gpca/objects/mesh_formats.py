"""Readers of PLY, OBJ, STL and OFF that hold what they declare; trimesh would take too long to import."""

import os
import re
from collections.abc import Callable, Iterator
from typing import IO, Any, NamedTuple

import numpy as np

from gpca.errors import InputError
from gpca.numerals import decimal

OFF_VERTEX_COLUMNS = (3, 6, 7)  # coordinates, alone or with a color
OFF_COLOR_COLUMNS = (0, 1, 3, 4)  # of a face
OBJ_VERTEX_COLUMNS = (3, 4, 6, 7)  # coordinates, alone, with a weight, with a color, with both
# Exporters write the vertices that their faces use. A file that ends early leaves more unused than a modeler does; an
# OBJ states its number of faces in no other way.
LARGEST_UNUSED_SHARE = 0.1
# Text takes a hundred times as long to parse as numbers in binary. A scan of a million triangles has 80 MB of text.
LARGEST_TEXT_BYTES = 250 * 10**6
LONGEST_LINE = 2**20  # bytes; a file with longer ones is not text
AXES, NORMALS = (b"x", b"y", b"z"), (b"nx", b"ny", b"nz")
CORNERS = (b"vertex_index", b"vertex_indices")  # names of the corners of a face in PLY
PLY_ORDERS = {b"ascii": "", b"binary_little_endian": "<", b"binary_big_endian": ">"}  # of bytes
PLY_KINDS = {
    word: kind
    for kind, words in {
        **{"i1": b"char int8", "u1": b"uchar uint8", "i2": b"short int16", "u2": b"ushort uint16", "i4": b"int int32"},
        **{"u4": b"uint uint32", "i8": b"int64", "u8": b"uint64", "f2": b"float16"},
        **{"f4": b"float float32", "f8": b"double float64"},
    }.items()
    for word in words.split()
}
STL_FACET = rb"facet\s+normal(?:\s+\S+){3}\s+outer\s+loop(?:\s+vertex(?:\s+\S+){3}){3}\s+endloop\s+endfacet"
STL_TEXT = re.compile(rb"(?i)(?:\s*solid[^\n]*+(?:\s*" + STL_FACET + rb")*+\s*endsolid[^\n]*+)++\s*")
STL_VERTEX = re.compile(rb"(?im)^\s*vertex\s+(\S+\s+\S+\s+\S+)")
STL_HEAD_BYTES = 84  # of binary STL; the head ends with the number of facets
STL_FACETS = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attributes", "<u2")])


class Shape(NamedTuple):
    """What a file holds, in its own unit."""

    vertices: np.ndarray  # (V, 3) float64
    faces: np.ndarray  # (F, 3) int64, none for a cloud
    normals: np.ndarray | None = None  # (V, 3) float64, of any length


class _Property(NamedTuple):
    name: bytes
    kind: str
    length_kind: str | None  # of a list


class _Element(NamedTuple):
    name: str
    rows: int
    properties: list[_Property]

    @property
    def corners(self) -> bytes | None:
        """The list of the corners of faces: by its name, or the only property."""
        if self.name != "face":
            return None
        lists = [each.name for each in self.properties if each.length_kind]
        only = lists[0] if lists and len(self.properties) == 1 else None
        return next((name for name in lists if name in CORNERS), only)


def _read_ply(file: IO[bytes]) -> Shape:
    order, elements = _ply_header(file)
    columns = _ply_binary(file, order, elements) if order else _ply_text(file, elements)
    vertex = columns.get("vertex", dict.fromkeys(AXES, np.zeros(0)))
    if not set(AXES) <= set(vertex):
        raise ValueError("its vertices lack x, y or z")
    vertices = np.stack([vertex[axis] for axis in AXES], axis=1, dtype=np.float64)
    normals, faces = None, np.zeros((0, 3), np.int64)
    if set(NORMALS) <= set(vertex):
        normals = np.stack([vertex[axis] for axis in NORMALS], axis=1, dtype=np.float64)
    for element in elements:
        if element.name == "face":
            if element.corners is None:
                raise ValueError("its faces have no list 'vertex_indices'")
            faces = as_triangles(columns["face"][element.corners])
    return Shape(vertices, faces, normals)


def _ply_header(file: IO[bytes]) -> tuple[str, list[_Element]]:
    """Return the order of bytes, none for text, and the elements that have rows."""
    elements: dict[str, _Element] = {}
    form, lines = b"", bounded_lines(file)
    if next(lines, b"").strip() != b"ply":
        raise ValueError("it does not begin with 'ply'")
    properties: list[_Property] | None = None
    for line in lines:
        match line.split():
            case [b"end_header", *_]:
                if form not in PLY_ORDERS:
                    raise ValueError(f"its format {quoted(form)} is unknown")
                return PLY_ORDERS[form], [element for element in elements.values() if element.rows]
            case [b"format", form, *_]:
                pass
            case [b"element", word, count]:
                if (name := word.decode("ascii", "replace")) in elements:
                    raise ValueError(f"its header declares element {name} twice")
                properties = []
                elements[name] = _Element(name, as_count(count), properties)
            case ([b"property", kind, name] | [b"property", b"list", _, kind, name]) as words if properties is not None:
                if name in (before.name for before in properties):
                    raise ValueError(f"its header declares property {quoted(name)} twice in one element")
                for word in words[1:-1]:
                    if word not in (b"list", *PLY_KINDS):
                        raise ValueError(f"its header contains the unknown type {quoted(word)}")
                length_kind = PLY_KINDS[words[2]] if len(words) == 5 else None
                properties.append(_Property(name, PLY_KINDS[kind], length_kind))
            case [b"format" | b"element" | b"property", *_]:
                raise ValueError(f"its header contains {quoted(line.strip())}")
    raise ValueError("its header has no end")


def _ply_text(file: IO[bytes], elements: list[_Element]) -> dict[str, dict[bytes, Any]]:
    rows = (row.split() for row in text_lines(file) if row.strip())
    data = {}
    for element in elements:
        corners, wanted = element.corners, (*AXES, *NORMALS, element.corners)
        kept: dict[bytes, list] = {each.name: [] for each in element.properties if each.name in wanted}
        for i in range(element.rows):
            row, place, subject = next(rows, None), 0, f"row {i + 1} of {element.rows} of element {element.name}"
            if row is None:
                raise ValueError(f"{subject} is missing")
            for name, _, length_kind in element.properties:
                start, length = place, 1
                if length_kind and place < len(row):
                    start, length = place + 1, as_count(row[place])
                values, place = row[start : start + length], start + length
                if name == corners:
                    if length < 3:
                        raise ValueError(f"{subject} has {length} corners")
                    if not all(word.isdigit() for word in values):
                        raise ValueError(f"{subject} has a corner that is not a number of a vertex")
                    kept[name].append([int(word) for word in values])
                elif name in kept:
                    kept[name].append(b" ".join(values))
            if place != len(row):
                raise ValueError(f"{subject} does not match its header")
        data[element.name] = {
            name: _numbers(kept[name], 1)[:, 0].astype(kind) if name != corners else kept[name]
            for name, kind, _ in element.properties
            if name in kept
        }
    if next(rows, None) is not None:
        raise ValueError("more rows than the header states")
    return data


def _ply_binary(file: IO[bytes], order: str, elements: list[_Element]) -> dict[str, dict[bytes, Any]]:
    content, place, data = file.read(), 0, {}
    for element in elements:
        fields: list[tuple] = []  # named by their position; lists are as long as the first
        for i, (_, kind, length_kind) in enumerate(element.properties):
            length: tuple[int, ...] = ()
            if length_kind:
                start = place + np.dtype(fields).itemsize
                length = (int(np.frombuffer(content, order + length_kind, 1, start)[0]),)
                fields.append((f"{i} length", order + length_kind))
            fields.append((str(i), order + kind, length))
        rows = np.frombuffer(content, np.dtype(fields), element.rows, place)
        for i, (name, _, length_kind) in enumerate(element.properties):
            if not length_kind:
                continue
            lengths = rows[f"{i} length"]
            if (lengths != lengths[0]).any():
                raise ValueError(f"lists of element {element.name} differ in length")
            if name == element.corners and lengths[0] < 3:
                raise ValueError(f"element {element.name} has rows of {lengths[0]} corners")
        data[element.name] = {name: rows[str(i)] for i, (name, *_) in enumerate(element.properties)}
        place += rows.nbytes
    if place != len(content):
        raise ValueError(f"its header states {place} bytes of data, but it has {len(content)}")
    return data


def _read_off(file: IO[bytes]) -> Shape:
    rows = (words for words in (line.split(b"#")[0].split() for line in text_lines(file)) if words)
    head = next(rows, [b""])
    if not head[0].startswith((b"OFF", b"COFF")):
        raise ValueError("it does not begin with 'OFF'")
    # The counts may stand in the line of the word OFF or COFF, even without a space.
    counts = [word for word in (head[0].lstrip(b"COF"), *head[1:]) if word] or next(rows, [])
    vertices, faces = (as_count(word) for word in counts[:2])
    points, polygons = [], []
    for i in range(vertices):
        if len(row := next(rows, [])) not in OFF_VERTEX_COLUMNS:
            raise ValueError(f"vertex {i + 1} of {vertices} is missing or does not have 3 coordinates")
        points.append([decimal(word.decode("utf-8", "replace")) for word in row][:3])
    for i in range(faces):
        row = next(rows, [b"0"])
        corners = as_count(row[0])
        whole = len(row) - 1 - corners in OFF_COLOR_COLUMNS and all(word.isdigit() for word in row[1 : 1 + corners])
        if 0 < corners < 3:
            raise ValueError(f"face {i + 1} of {faces} has {corners} corners")
        if not corners or not whole:
            raise ValueError(f"face {i + 1} of {faces} is missing or does not have its stated length")
        polygons.append([int(word) for word in row[1 : 1 + corners]])
    if next(rows, None) is not None:
        raise ValueError("more rows than it declares")
    return Shape(np.array(points).reshape(-1, 3), as_triangles(polygons))


def _read_obj(file: IO[bytes]) -> Shape:
    rows: list[bytes] = []  # of vertices
    polygons: list[list[int]] = []
    others, before = False, b""
    for number, line in enumerate(text_lines(file), start=1):
        line = before + line.split(b"#")[0].rstrip()
        before = line[:-1] + b" " if line.endswith(b"\\") else b""  # it continues in the next line
        if before or not line.strip():
            continue
        keyword, *words = line.split()
        if keyword == b"v":
            if len(words) not in OBJ_VERTEX_COLUMNS or (len(words) == 4 and float(words[3]) != 1):
                raise ValueError(f"line {number}: a vertex has {len(words)} numbers or a weight other than 1")
            rows.append(b" ".join(words[:3]))
        elif keyword == b"f":
            corners = [int(word.split(b"/")[0]) for word in words]
            if len(corners) < 3 or 0 in corners:
                raise ValueError(f"line {number}: a face has {len(corners)} corners or refers to vertex 0")
            polygons.append([corner - 1 if corner > 0 else len(rows) + corner for corner in corners])
        others |= keyword in (b"l", b"p")  # lines and points use vertices, too
    if not polygons:
        raise InputError(file.name, "has no faces", "export it again, or give the points as PLY")
    faces = as_triangles(polygons)
    unused = len(rows) - len(np.unique(faces))
    if not others and unused > LARGEST_UNUSED_SHARE * len(rows):
        raise ValueError(f"{unused} of {len(rows)} vertices belong to no face, as in a truncated file")
    return Shape(_numbers(rows, 3), faces)


def _read_stl(file: IO[bytes]) -> Shape:
    head, size = file.read(STL_HEAD_BYTES), file.seek(0, os.SEEK_END)
    if size == STL_HEAD_BYTES + STL_FACETS.itemsize * int.from_bytes(head[80:], "little"):
        file.seek(STL_HEAD_BYTES)
        return _loose(np.frombuffer(file.read(), STL_FACETS)["vertices"])
    file.seek(0)
    if not STL_TEXT.fullmatch(text := b"".join(text_lines(file))):
        raise ValueError("it is neither whole facets from 'solid' to 'endsolid' nor as long as their number needs")
    return _loose(_numbers(STL_VERTEX.findall(text), 3))


def _loose(corners: np.ndarray) -> Shape:
    vertices = corners.reshape(-1, 3).astype(np.float64)
    return Shape(vertices, np.arange(len(vertices)).reshape(-1, 3))


READERS: dict[str, Callable[[IO[bytes]], Shape]] = {  # ValueError for a file that does not hold what it declares
    ".ply": _read_ply,
    ".obj": _read_obj,
    ".stl": _read_stl,
    ".off": _read_off,
}


def as_triangles(polygons: np.ndarray | list) -> np.ndarray:
    """Return the triangles (F, 3) of polygons, each a fan around its first corner."""
    if set(map(len, polygons)) == {3}:
        return np.array(polygons, np.int64)
    fans = [(polygon[0], polygon[i], polygon[i + 1]) for polygon in polygons for i in range(1, len(polygon) - 1)]
    return np.array(fans, np.int64).reshape(-1, 3)


def _numbers(rows: list[bytes], columns: int) -> np.ndarray:
    """Parse rows of text as C does: Python's float() takes underscores, too."""
    table = np.loadtxt(rows, np.float64, comments=None, ndmin=2) if rows else np.zeros((0, columns))
    if table.shape != (len(rows), columns):
        raise ValueError(f"its rows do not have {columns} numbers")
    return table


def text_lines(file: IO[bytes]) -> Iterator[bytes]:
    """Yield the remaining lines of a text file; InputError where it has too much text to parse."""
    if (size := os.fstat(file.fileno()).st_size) > LARGEST_TEXT_BYTES:
        fault = f"has {size / 1e6:.0f} MB of text, more than the limit of {LARGEST_TEXT_BYTES / 1e6:.0f} MB"
        raise InputError(file.name, fault, "export it as binary PLY, or with fewer faces")
    yield from bounded_lines(file)


def bounded_lines(file: IO[bytes]) -> Iterator[bytes]:
    while line := file.readline(LONGEST_LINE):
        if len(line) == LONGEST_LINE:
            raise ValueError(f"a line is longer than {LONGEST_LINE} bytes, so it is not text")
        yield line


def as_count(word: bytes) -> int:
    if not word.isdigit():
        raise ValueError(f"{quoted(word)} is not a count")
    return int(word)


def quoted(word: bytes) -> str:
    return f"'{word[:40].decode('ascii', 'replace')}'"
