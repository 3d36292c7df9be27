"""What a mesh file of text declares, held against what it holds: PLY, OFF and OBJ.

trimesh reads a row that is too wide, a list of another length, an index 0 or a file that ends early as another mesh,
without a word.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from gpca.numerals import decimal

OFF_VERTEX_COLUMNS = (3, 6, 7)  # coordinates, alone or with a colour
OFF_COLOUR_COLUMNS = (0, 1, 3, 4)  # of a face
OBJ_VERTEX_COLUMNS = (3, 4, 6, 7)  # coordinates, alone, with a weight, with a colour, with both
# An exporter writes the vertices that its faces use. Of a file that ends early, more are left over than a modeller
# leaves behind; an OBJ says in no other way how many faces it should have.
LARGEST_UNUSED_SHARE = 0.1


def require_whole(path: Path) -> None:
    """Raise a ValueError where a file of text does not hold what it declares; a binary one passes."""
    check = {".ply": _check_ply, ".off": _check_off, ".obj": _check_obj}.get(path.suffix.lower())
    if check:
        check(path)


def _check_ply(path: Path) -> None:
    with path.open("rb") as file:
        elements = _ply_elements(file)
        if elements is None:
            return
        rows = (row.split() for row in file if row.strip())
        for name, count, properties in elements:
            lists = [prop[1] == b"list" for prop in properties]
            corners = [prop[-1] in (b"vertex_index", b"vertex_indices") for prop in properties]
            for i in range(count):
                if not _fits(row := next(rows, None), lists, corners):
                    found = "is missing" if row is None else "does not match its header"
                    raise ValueError(f"row {i + 1} of {count} of element {name} {found}")
        if next(rows, None) is not None:
            raise ValueError("more rows than the header states")


def _ply_elements(file) -> list[tuple[str, int, list[list[bytes]]]] | None:
    """Return name, count and properties of each element; None for a binary file."""
    elements: list[tuple[str, int, list[list[bytes]]]] = []
    text = False
    for line in file:
        words = line.split()
        if words[:1] == [b"end_header"]:
            return elements if text else None
        if words[:1] == [b"format"]:
            text = words[1:2] == [b"ascii"]
        elif words[:1] == [b"element"]:
            elements.append((words[1].decode("ascii", "replace"), _count(words[2]), []))
        elif words[:1] == [b"property"]:
            elements[-1][2].append(words)
    raise ValueError("its header has no end")


def _fits(row: list[bytes] | None, lists: list[bool], corners: list[bool]) -> bool:
    """Return whether a row has a word for each property, and for a list as many as it says."""
    if row is None:
        return False
    position = 0
    for is_list, is_corners in zip(lists, corners, strict=True):
        length = 0
        if is_list and position < len(row):
            length = _count(row[position])
            words = row[position + 1 : position + 1 + length]
            if is_corners and (length < 3 or not all(word.isdigit() for word in words)):
                return False
        position += 1 + length
    return position == len(row)


def _check_off(path: Path) -> None:
    with path.open("rb") as file:
        rows = (words for words in (line.split(b"#")[0].split() for line in file) if words)
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
            whole = len(row) - 1 - corners in OFF_COLOUR_COLUMNS and all(
                word.isdigit() for word in row[1 : 1 + corners]
            )
            if corners < 3 or not whole:
                raise ValueError(f"face {i + 1} of {faces} is missing or does not have its stated length")
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
    if used and (min(used) < 1 or max(used) > vertices):
        raise ValueError("a face refers to a missing vertex")
    if relative_at not in (-1, vertices):
        raise ValueError("faces use relative numbers before the last vertex; export it with absolute numbers")
    if used and not others and len(used) < (1 - LARGEST_UNUSED_SHARE) * vertices:
        raise ValueError(f"{vertices - len(used)} of {vertices} vertices belong to no face, as in a truncated file")


def _obj_rows(path: Path) -> Iterator[tuple[int, list[bytes]]]:
    """Yield number and words of each line; one that ends in a backslash goes on in the next."""
    before = b""
    with path.open("rb") as file:
        for number, line in enumerate(file, start=1):
            line = before + line.split(b"#")[0].rstrip()
            before = line[:-1] + b" " if line.endswith(b"\\") else b""
            if not before and line.strip():
                yield number, line.split()


def _count(word: bytes) -> int:
    if not word.isdigit():
        raise ValueError(f"'{word.decode('ascii', 'replace')}' is not a count")
    return int(word)
