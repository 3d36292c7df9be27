"""Readers of legacy VTK (datasets PolyData) and of binary glTF 2.0, without their libraries.

VTK has versions 1 to 5; what follows the geometry is not read. Each mesh of glTF stands where the nodes put it.
"""

import json
import os
import struct
from collections.abc import Callable, Iterator
from typing import IO, Any

import numpy as np

from gpca.io.files import require_memory
from gpca.objects.mesh_formats import Shape, as_count, as_triangles, bounded_lines, quoted, text_lines
from gpca.rigid import transform

VTK_KINDS = {
    **{b"float": "f4", b"double": "f8", b"int": "i4", b"unsigned_int": "u4", b"vtktypeint64": "i8", b"vtkidtype": "i4"},
    **{b"short": "i2", b"unsigned_short": "u2", b"char": "i1", b"unsigned_char": "u1"},
    **{b"long": "i8", b"unsigned_long": "u8"},
}
VTK_CELLS = (b"VERTICES", b"LINES", b"POLYGONS", b"TRIANGLE_STRIPS")
GLTF_KINDS = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
GLTF_POINTS, GLTF_TRIANGLES, GLTF_STRIPS = 0, 4, (5, 6)  # kinds of primitives; the others are lines


class _VTK:
    """The lines and arrays of a legacy file, one after the other."""

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
    content = file.read()
    magic, version, size = struct.unpack_from("<4sII", content)
    if magic != b"glTF" or version != 2:
        raise ValueError("it is no binary glTF of version 2")
    if size != len(content):
        raise ValueError(f"it states {size} bytes, but has {len(content)}")
    length, _ = struct.unpack_from("<I4s", content, 12)
    described = json.loads(content[20 : 20 + length])
    binary = content[28 + length :]
    packed = [name for name in described.get("extensionsRequired", ()) if "compression" in name]
    if packed:
        raise ValueError(f"it is compressed by {packed[0]}; export it without")
    vertices, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], 0
    for T, mesh in _placed(described):
        for primitive in mesh["primitives"]:
            mode = primitive.get("mode", GLTF_TRIANGLES)
            if mode in GLTF_STRIPS:
                raise ValueError("it has strips or fans of triangles; export it as triangles")
            if mode not in (GLTF_POINTS, GLTF_TRIANGLES):
                continue
            points = _accessed(described, binary, primitive["attributes"]["POSITION"], 3).astype(np.float64)
            require_memory(24 * (count + len(points)), len(content), file.name, "export it without copies")
            if mode == GLTF_TRIANGLES:
                corners = np.arange(len(points))
                if "indices" in primitive:
                    corners = _accessed(described, binary, primitive["indices"], 1).astype(np.int64)
                faces.append(count + corners.reshape(-1, 3))
            vertices.append(transform(T, points))
            count += len(points)
    return Shape(np.concatenate(vertices), np.concatenate(faces))


def _placed(described: dict[str, Any]) -> Iterator[tuple[np.ndarray, dict[str, Any]]]:
    """Yield the affine map (4, 4) and the mesh of each node of the scene."""
    nodes = described.get("nodes", [])
    children = {child for node in nodes for child in node.get("children", ())}
    roots = [i for i in range(len(nodes)) if i not in children]
    if scenes := described.get("scenes"):
        roots = scenes[described.get("scene", 0)].get("nodes", [])
    if not nodes:
        yield from ((np.eye(4), mesh) for mesh in described["meshes"])
    waiting, visited = [(i, np.eye(4)) for i in roots], set()
    while waiting:
        i, T = waiting.pop()
        if i in visited:
            raise ValueError(f"node {i} stands in two places")
        visited.add(i)
        T = T @ _local(nodes[i])
        if "mesh" in nodes[i]:
            yield T, described["meshes"][nodes[i]["mesh"]]
        waiting += [(child, T) for child in nodes[i].get("children", ())]


def _local(node: dict[str, Any]) -> np.ndarray:
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T  # column by column
    from scipy.spatial.transform import Rotation

    T = np.eye(4)
    T[:3, :3] = Rotation.from_quat(node.get("rotation", (0, 0, 0, 1))).as_matrix() * node.get("scale", (1, 1, 1))
    T[:3, 3] = node.get("translation", (0, 0, 0))
    return T


def _accessed(described: dict[str, Any], binary: bytes, number: int, width: int) -> np.ndarray:
    """Return the rows (n, width) of an accessor."""
    accessor = described["accessors"][number]
    if "sparse" in accessor or "bufferView" not in accessor:
        raise ValueError("it has sparse or empty accessors; export it without")
    view = described["bufferViews"][accessor["bufferView"]]
    if view["buffer"] or "uri" in described["buffers"][0]:
        raise ValueError("its data are in another file; export them with it")
    if (width == 3) != (accessor["type"] == "VEC3") or (width == 3) != (accessor["componentType"] == 5126):
        raise ValueError(f"accessor {number} is of another type")
    dtype = np.dtype(f"<{GLTF_KINDS[accessor['componentType']]}")
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    stride = view.get("byteStride", width * dtype.itemsize)
    if start < 0 or stride < width * dtype.itemsize:
        raise ValueError(f"the rows of accessor {number} overlap, or begin before its data")
    return np.ndarray((accessor["count"], width), dtype, binary, start, (stride, dtype.itemsize))


READERS: dict[str, Callable[[IO[bytes]], Shape]] = {".vtk": _read_vtk, ".glb": _read_glb}
