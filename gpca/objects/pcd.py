"""Point Cloud Data (PCD 0.6, 0.7): ascii, binary and binary_compressed.

Format: https://pointclouds.org/documentation/tutorials/pcd_file_format.html
Open3D's reader (0.19) does not serve here: it takes a cut ascii file, a short row, a header without WIDTH or with an
unknown TYPE for whole ones and fills the gaps with whatever the memory holds, and it reads a double after bytes as 0.
"""

from __future__ import annotations

import io
import struct
from dataclasses import dataclass

import numpy as np

from gpca.errors import InputError
from gpca.io.limits import require_memory
from gpca.numerals import whole
from gpca.objects.canonical import require_points

SCALARS = {
    f"{kind}{size}" for kind, sizes in (("f", (4, 8)), ("i", (1, 2, 4, 8)), ("u", (1, 2, 4, 8))) for size in sizes
}


@dataclass(frozen=True)
class _Header:
    dtype: np.dtype  # one field per column of FIELDS, named by its position, since PCD repeats the name "_"
    xyz: tuple[int, ...]  # positions of x, y, z
    points: int
    organized: bool
    encoding: str

    @property
    def columns(self) -> list[np.dtype]:
        return [self.dtype[name] for name in self.dtype.names or ()]


def parse(content: bytes, subject: object) -> np.ndarray:
    """Return the points of a PCD file.

    Args:
        content: the whole file.
        subject: its name for messages.

    Returns:
        (P, 3) float64 in the file's unit. An organized cloud (HEIGHT > 1) marks missing depth by NaN, and those
        points are left out; in any other cloud NaN is a fault.

    Raises:
        InputError: wrong header, fewer or more data than the header says, no points, NaN.
    """
    try:
        header, body = _parse_header(content)
        points = _DECODERS[header.encoding](body, header)
    except (ValueError, KeyError, IndexError, TypeError, struct.error) as fault:
        raise InputError(subject, f"is not a readable PCD file ({fault})", "fetch or export it again") from fault
    if header.organized:
        points = points[~np.isnan(points).any(axis=1)]
    require_points(points, subject)
    return points


def _parse_header(content: bytes) -> tuple[_Header, bytes]:
    values: dict[str, list[str]] = {}
    position = 0
    while "DATA" not in values:
        end = content.find(b"\n", position)
        if end < 0 or end - position > 10_000:
            raise ValueError("wrong header: no DATA line")
        key, *words = content[position:end].decode("ascii", "replace").split() or ["#"]
        if not key.startswith("#"):
            values[key] = words
        position = end + 1
    for key in ("FIELDS", "SIZE", "TYPE", "WIDTH", "HEIGHT", "POINTS"):
        if not values.get(key):
            raise ValueError(f"wrong header: no {key} line")
    fields = values["FIELDS"]
    sizes = values["SIZE"]
    types = values["TYPE"]
    counts = values.get("COUNT", ["1"] * len(fields))
    if not len(fields) == len(sizes) == len(types) == len(counts):
        raise ValueError("wrong header: FIELDS, SIZE, TYPE and COUNT differ in length")
    scalars = [kind.lower() + size for kind, size in zip(types, sizes, strict=True)]
    if not set(scalars) <= SCALARS:
        raise ValueError("wrong header: unknown SIZE or TYPE")
    if not {"x", "y", "z"} <= set(fields) or any(counts[fields.index(axis)] != "1" for axis in "xyz"):
        raise ValueError("wrong header: FIELDS lacks x, y or z")
    width, height, points = (whole(values[key][0], most=10**18) for key in ("WIDTH", "HEIGHT", "POINTS"))
    if width * height != points:
        raise ValueError("wrong header: POINTS is not WIDTH times HEIGHT")
    encoding = " ".join(values["DATA"])
    if encoding not in _DECODERS:
        raise ValueError(f"wrong header: unknown DATA {encoding}")
    dtype = np.dtype(
        [(str(i), f"<{scalar}", (whole(count),)) for i, (scalar, count) in enumerate(zip(scalars, counts, strict=True))]
    )
    return _Header(dtype, tuple(fields.index(axis) for axis in "xyz"), points, height > 1, encoding), content[position:]


def _ascii(body: bytes, header: _Header) -> np.ndarray:
    columns = [field.shape[0] for field in header.columns]
    starts = np.cumsum([0, *columns])
    if header.points == 0:
        return np.zeros((0, 3))
    table = np.loadtxt(io.BytesIO(body), dtype=np.float64, ndmin=2, comments=None)
    if table.shape != (header.points, starts[-1]):
        raise ValueError(f"the header states {header.points}×{starts[-1]} values, but the file has {table.shape}")
    return table[:, starts[list(header.xyz)]]


def _binary(body: bytes, header: _Header) -> np.ndarray:
    if len(body) != header.points * header.dtype.itemsize:
        raise ValueError(
            f"the header states {header.points * header.dtype.itemsize} bytes of data, but the file has {len(body)}"
        )
    table = np.frombuffer(body, header.dtype)
    return np.column_stack([table[str(i)][:, 0] for i in header.xyz]).astype(np.float64)


def _binary_compressed(body: bytes, header: _Header) -> np.ndarray:
    compressed, size = struct.unpack_from("<II", body)
    if len(body) < 8 + compressed:
        raise ValueError("the file ends within its compressed data")
    require_memory(size, compressed, "its compressed data", "")
    columns = _lzf_decompress(body[8 : 8 + compressed], size)
    if not len(columns) == size == header.points * header.dtype.itemsize:
        raise ValueError("its compressed data does not have the size that the header states")
    starts = header.points * np.cumsum([0, *(field.itemsize for field in header.columns)])
    arrays = [np.frombuffer(columns, header.dtype[i].base, header.points, int(starts[i])) for i in header.xyz]
    return np.column_stack(arrays).astype(np.float64)


_DECODERS = {"ascii": _ascii, "binary": _binary, "binary_compressed": _binary_compressed}


def _lzf_decompress(data: bytes, size: int) -> bytearray:
    """Undo LZF: runs of literal bytes, and copies of up to 264 earlier bytes that may overlap what they write.

    It stops once there are more than `size` bytes.
    """
    out = bytearray()
    i = 0
    while i < len(data) and len(out) <= size:
        control = data[i]
        i += 1
        if control < 32:
            out += data[i : i + control + 1]
            i += control + 1
            continue
        length = control >> 5
        if length == 7:
            length += data[i]
            i += 1
        start = len(out) - ((control & 31) << 8) - data[i] - 1
        i += 1
        if start < 0:
            raise ValueError("its compressed data is damaged")
        length += 2
        earlier = out[start : start + length]
        out += (earlier * (length // len(earlier) + 1))[:length]
    return out
