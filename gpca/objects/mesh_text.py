"""Mesh files of text, PLY, OFF, OBJ and STL, must hold what they declare.

trimesh reads a row that is too wide, a list of another length, an index 0, a misspelled keyword or a file that ends
early as another mesh, without a word.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from gpca.errors import InputError
from gpca.numerals import decimal

OFF_VERTEX_COLUMNS = (3, 6, 7)  # coordinates, alone or with a color
OFF_COLOR_COLUMNS = (0, 1, 3, 4)  # of a face
OBJ_VERTEX_COLUMNS = (3, 4, 6, 7)  # coordinates, alone, with a weight, with a color, with both
# An exporter writes the vertices that its faces use. Of a file that ends early, more are left over than a modeler
# leaves behind; an OBJ says in no other way how many faces it should have.
LARGEST_UNUSED_SHARE = 0.1
# Text takes a hundred times as long to parse as numbers in binary. A scan of a million triangles has 80 MB of text.
LARGEST_TEXT_BYTES = 250 * 10**6
LONGEST_LINE = 2**20  # bytes; what has longer ones is no text
CORNERS = (b"vertex_index", b"vertex_indices")  # what the corners of a face are called in PLY
PLY_FORMATS = (b"ascii", b"binary_little_endian", b"binary_big_endian")
STL_FACET = (b"facet normal", b"outer loop", b"vertex", b"vertex", b"vertex", b"endloop", b"endfacet")
STL_NUMBERS = {b"facet normal": 3, b"vertex": 3}
STL_HEAD_BYTES, STL_FACET_BYTES = 84, 50  # of binary STL; the head ends with the number of facets


def require_whole(path: Path) -> None:
    """Check that a file of text holds what it declares; of a binary one, only the header of PLY is checked.

    Raises:
        ValueError: it does not.
        InputError: it has too much text to be parsed, or no faces in a format that is for meshes alone.
    """
    check = {".ply": _check_ply, ".off": _check_off, ".obj": _check_obj, ".stl": _check_stl}.get(path.suffix.lower())
    if check:
        check(path)


def _check_ply(path: Path) -> None:
    with path.open("rb") as file:
        is_text, elements = _ply_header(file)
        if not is_text:
            return
        rows = (row.split() for row in _lines(file) if row.strip())
        for name, count, properties in elements:
            lists = [prop[1] == b"list" for prop in properties]
            corners = [prop[-1] in CORNERS for prop in properties]
            for i in range(count):
                if fault := _fault_of_row(next(rows, None), lists, corners):
                    raise ValueError(f"row {i + 1} of {count} of element {name} {fault}")
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


def _fault_of_row(row: list[bytes] | None, lists: list[bool], corners: list[bool]) -> str:
    """Return why a row has not one word for each property, and for a list as many as it says; empty where it has."""
    if row is None:
        return "is missing"
    position = 0
    for is_list, is_corners in zip(lists, corners, strict=True):
        length = 0
        if is_list and position < len(row):
            length = _count(row[position])
            words = row[position + 1 : position + 1 + length]
            if is_corners and length < 3:
                return f"has {length} corners"
            if is_corners and not all(word.isdigit() for word in words):
                return "has a corner that is not a number of a vertex"
        position += 1 + length
    return "" if position == len(row) else "does not match its header"


def _check_off(path: Path) -> None:
    with path.open("rb") as file:
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
            if corners < 3 or not whole:
                defect = (
                    f"has {corners} corners" if 0 < corners < 3 else "is missing or does not have its stated length"
                )
                raise ValueError(f"face {i + 1} of {faces} {defect}")
        if next(rows, None) is not None:
            raise ValueError("more rows than it declares")


def _check_obj(path: Path) -> None:
    vertices, relative_at = 0, -1
    used: set[int] = set()
    others = False
    for number, words in _obj_rows(path):
        if words[0] == b"v":
            vertices += 1
            columns = len(words) - 1
            if columns not in OBJ_VERTEX_COLUMNS or (columns == 4 and float(words[4]) != 1):
                raise ValueError(f"line {number}: a vertex has {columns} numbers or a weight other than 1")
        elif words[0] == b"f":
            corners = [int(word.split(b"/")[0]) for word in words[1:]]
            if len(corners) < 3 or 0 in corners:
                raise ValueError(f"line {number}: a face has {len(corners)} corners or refers to vertex 0")
            if min(corners) < 0:
                relative_at = vertices
            used.update(corner if corner > 0 else vertices + 1 + corner for corner in corners)
        others |= words[0] in (b"l", b"p")  # lines and points use vertices, too
    if not used:
        raise InputError(path, "has no faces", "export it again, or give the points as PLY")
    if min(used) < 1 or max(used) > vertices:
        raise ValueError("a face refers to a missing vertex")
    if relative_at not in (-1, vertices):
        raise ValueError("faces use relative numbers before the last vertex; export it with absolute numbers")
    if not others and len(used) < (1 - LARGEST_UNUSED_SHARE) * vertices:
        raise ValueError(f"{vertices - len(used)} of {vertices} vertices belong to no face, as in a truncated file")


def _obj_rows(path: Path) -> Iterator[tuple[int, list[bytes]]]:
    """Yield number and words of each line; one that ends in a backslash goes on in the next."""
    before = b""
    with path.open("rb") as file:
        for number, line in enumerate(_lines(file), start=1):
            line = before + line.split(b"#")[0].rstrip()
            before = line[:-1] + b" " if line.endswith(b"\\") else b""
            if not before and line.strip():
                yield number, line.split()


def _check_stl(path: Path) -> None:
    with path.open("rb") as file:
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
            keyword = STL_FACET[place]
            length = len(keyword.split())
            if (written := b" ".join(words[:length])) != keyword:
                raise ValueError(f"line {number}: {_shown(written)} stands where {_shown(keyword)} should")
            if (numbers := len(words) - length) != STL_NUMBERS.get(keyword, 0):
                raise ValueError(f"line {number}: {_shown(keyword)} has {numbers} numbers")
            place = (place + 1) % len(STL_FACET)
    if keyword != b"endsolid":
        raise ValueError("it ends before 'endsolid'")


def _lines(file: IO[bytes]) -> Iterator[bytes]:
    """Yield the remaining lines of a file of text.

    Raises:
        InputError: it has too much text to be parsed.
    """
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
