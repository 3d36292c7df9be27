"""Point clouds in files: PCD (0.6, 0.7), NumPy's, text, and bin of scanners; rows without a measurement are kept."""

import io
import re
import struct
import warnings
import zipfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from itertools import groupby
from pathlib import Path

import numpy as np

from gpca.errors import InputError, refusing
from gpca.io.files import require_file, require_memory
from gpca.numerals import whole
from gpca.objects.canonical import require_points
from gpca.objects.mesh_folder import files_in
from gpca.objects.mesh_formats import LARGEST_TEXT_BYTES
from gpca.objects.surface import Surface, evenly, instance_of, meters_per, view_order

SCALARS = {"f4", "f8", *(f"{sign}{size}" for sign in "iu" for size in (1, 2, 4, 8))}
AXES = ("x", "y", "z")


def parse_pcd(content: bytes, subject: object) -> np.ndarray:
    """Return the points (P, 3) float64 of a PCD file's content, in the file's unit; `subject` names it in messages."""
    try:
        return _parse_pcd(content)
    except (ValueError, KeyError, IndexError, TypeError, struct.error) as fault:
        raise InputError(subject, f"is not a readable PCD file ({fault})", "fetch or export it again") from fault


def _parse_pcd(content: bytes) -> np.ndarray:
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
    counts = values.get("COUNT", ["1"] * len(fields))
    if not len(fields) == len(values["SIZE"]) == len(values["TYPE"]) == len(counts):
        raise ValueError("wrong header: FIELDS, SIZE, TYPE and COUNT differ in length")
    scalars = [kind.lower() + size for kind, size in zip(values["TYPE"], values["SIZE"], strict=True)]
    if not set(scalars) <= SCALARS:
        raise ValueError("wrong header: unknown SIZE or TYPE")
    if not set(AXES) <= set(fields) or any(counts[fields.index(axis)] != "1" for axis in AXES):
        raise ValueError("wrong header: FIELDS lacks x, y or z")
    width, height, count = (whole(values[key][0], most=10**18) for key in ("WIDTH", "HEIGHT", "POINTS"))
    if width * height != count:
        raise ValueError("wrong header: POINTS is not WIDTH times HEIGHT")
    lengths = [whole(length) for length in counts]
    columns = [np.dtype((f"<{scalar}", (length,))) for scalar, length in zip(scalars, lengths, strict=True)]
    dtype = np.dtype([(str(i), column) for i, column in enumerate(columns)])  # PCD repeats the name "_"
    body, xyz, size = content[position:], [fields.index(axis) for axis in AXES], count * dtype.itemsize
    match " ".join(values["DATA"]):
        case "ascii":
            starts = np.cumsum([0, *lengths])
            rows = io.BytesIO(body)
            table = np.loadtxt(rows, ndmin=2, comments=None) if count else np.zeros((0, starts[-1]))
            if table.shape != (count, starts[-1]):
                raise ValueError(f"the header states {count}×{starts[-1]} values, but the file has {table.shape}")
            points = table[:, starts[xyz]]
        case "binary":
            if len(body) != size:
                raise ValueError(f"the header states {size} bytes of data, but the file has {len(body)}")
            records = np.frombuffer(body, dtype)
            points = np.column_stack([records[str(i)][:, 0] for i in xyz])
        case "binary_compressed":
            packed, unpacked = struct.unpack_from("<II", body)
            if len(body) < 8 + packed:
                raise ValueError("the file ends within its compressed data")
            require_memory(unpacked, packed, "its compressed data", "")
            data = _lzf_decompress(body[8 : 8 + packed], unpacked)
            if not len(data) == unpacked == size:
                raise ValueError("its compressed data does not have the size that the header states")
            starts = count * np.cumsum([0, *(column.itemsize for column in columns)])
            points = np.column_stack([np.frombuffer(data, columns[i].base, count, int(starts[i])) for i in xyz])
        case encoding:
            raise ValueError(f"wrong header: unknown DATA {encoding}")
    return points.astype(np.float64)


def _lzf_decompress(data: bytes, size: int) -> bytearray:
    """Undo LZF: literals, and copies of up to 264 earlier bytes that may overlap; stops after `size` bytes."""
    out, i = bytearray(), 0
    while i < len(data) and len(out) <= size:
        length, offset = data[i] >> 5, (data[i] & 31) << 8
        if length == 0:
            out += data[i + 1 : i + offset // 256 + 2]
            i += offset // 256 + 2
            continue
        if length == 7:
            i += 1
            length += data[i]
        start = len(out) - offset - data[i + 1] - 1
        if start < 0:
            raise ValueError("its compressed data is damaged")
        earlier = out[start : start + length + 2]
        out += (earlier * ((length + 2) // len(earlier) + 1))[: length + 2]
        i += 2
    return out


# What the array of points is called in an npz that holds others too, most usual first.
NAMES = ("points", "xyz", "positions", "pos", "coords", "vertices", "pcd", "cloud", "data")
SEPARATORS = (",", ";", "\t")
# Columns of float32 in a bin file: x, y, z and the intensity, as KITTI has them; nuScenes adds the number of the ring.
BIN_COLUMNS = (4, 5)
NUSCENES = ".pcd.bin"  # how names of nuScenes end
FARTHEST_SCANNED = 1e4  # meters; no such scanner sees so far, so the file holds something else
MOST_RINGS = 256
# Read with too few or too many columns, each column holds values of all, so that their mean sizes are nearly equal.
LEAST_CONTRAST = 1.5  # largest mean size of a column over the smallest
COLUMNS_REMEDY = "export it as three columns x, y, z"


def _numpy_file(path: Path) -> np.ndarray:
    """Read an npy, or the array of points of an npz: by its name, or the only one."""
    # numpy and zipfile raise errors of many kinds for a damaged file.
    with refusing(path, f"is not a readable {path.suffix} file ({{}})", "save it again"):
        if path.suffix.lower() == ".npz":
            with zipfile.ZipFile(path) as members:
                size = sum(info.file_size for info in members.infolist())
            require_memory(size, path.stat().st_size, path, "save it again")
        array = np.load(path, allow_pickle=False)
        if not isinstance(array, np.ndarray):
            with array as archive:
                names = [name for name in NAMES if name in archive.files] or archive.files
                if not names:
                    raise InputError(path, "holds no array", COLUMNS_REMEDY)
                if len(names) > 1 and names == archive.files:
                    several = ", ".join(archive.files[:8])
                    fault = f"holds several arrays ({several}), none of them named 'points'"
                    raise InputError(path, fault, "rename one")
                array = archive[names[0]]
    if array.dtype.names:
        if not set(AXES) <= set(array.dtype.names):
            raise InputError(path, f"has the fields {', '.join(array.dtype.names[:8])}, not x, y, z", COLUMNS_REMEDY)
        array = np.stack([np.asarray(array[axis], np.float64).ravel() for axis in AXES], axis=1)
    if array.dtype.kind not in "iuf":
        raise InputError(path, f"holds values of type {array.dtype}, not numbers", COLUMNS_REMEDY)
    if array.ndim == 3 and array.shape[2] == 3:  # one point per pixel
        array = array.reshape(-1, 3)
    wrong = array.ndim == 2 and array.shape[0] == 3 != array.shape[1]  # three points are no cloud
    if array.ndim != 2 or array.shape[1] < 3 or wrong:
        raise InputError(path, f"has the shape {array.shape}, not (N, 3)", "transpose it" if wrong else COLUMNS_REMEDY)
    return np.ascontiguousarray(array[:, :3], np.float64)


def _text(path: Path) -> np.ndarray:
    """Read the first three columns, or those that a header names x, y and z; # or // begin comments."""
    require_file(path, "no such file", COLUMNS_REMEDY, LARGEST_TEXT_BYTES)
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    lines = [line for line in lines if line.strip() and not line.lstrip().startswith(("#", "//"))]
    if not lines:
        raise InputError(path, "has no points", COLUMNS_REMEDY)
    separator = next((sign for sign in SEPARATORS if sign in lines[0]), None)
    words = [word.strip().strip('"').lower() for word in lines[0].split(separator)]
    columns: tuple[int, ...] = (0, 1, 2)
    if names_columns := not any(map(_is_number, words)):
        if not set(AXES) <= set(words):
            raise InputError(path, f"has the columns {', '.join(words[:8])}, not x, y, z", COLUMNS_REMEDY)
        columns = tuple(map(words.index, AXES))
    is_head = names_columns or (len(words) == 1 and len(lines) > 1)
    if not is_head and len(words) < 3:
        raise InputError(path, f"has {len(words)} columns", COLUMNS_REMEDY)
    with warnings.catch_warnings(), refusing(path, "is no table of numbers ({})", COLUMNS_REMEDY):
        warnings.simplefilter("ignore", UserWarning)  # of a table without rows
        text = "\n".join(["", *lines[is_head:], ""])
        if separator and any(gap in text for gap in (2 * separator, f"{separator}\n", f"\n{separator}")):
            # pandas writes nothing for NaN
            text = re.sub(f"(?m)^(?={separator})|(?<={separator})(?={separator}|$)", "nan", text)
        table = np.loadtxt(io.StringIO(text), np.float64, delimiter=separator, ndmin=2, usecols=columns, comments=None)
    if table.shape[1] != 3 or not len(table):
        raise InputError(path, "has no points", COLUMNS_REMEDY)
    return table


def _is_number(word: str) -> bool:
    with suppress(ValueError):
        return float(word) is not None
    return False


def _scanner_bin(path: Path) -> np.ndarray:
    """Read rows of `BIN_COLUMNS`: as many as the size allows and the values bear out, in one way alone."""
    remedy = "give one of KITTI or nuScenes, or save it as npy"
    widths = BIN_COLUMNS[1:] if path.name.lower().endswith(NUSCENES) else BIN_COLUMNS
    values = np.fromfile(path, "<f4") if path.stat().st_size % 4 == 0 else np.zeros(0, "<f4")
    tables = [values.reshape(-1, width) for width in widths if len(values) and len(values) % width == 0]
    fitting = [table for table in tables if _is_scan(table)]
    if len(fitting) != 1:
        rows = " or ".join(map(str, widths))
        holds = "may hold" if fitting else "does not hold"
        raise InputError(path, f"{holds} rows of {rows} float32: x, y, z in meters, intensity, ring", remedy)
    return fitting[0][:, :3].astype(np.float64)


def _is_scan(table: np.ndarray) -> bool:
    """Return whether rows can be x, y, z, an intensity and perhaps the number of a ring; x, y, z may be NaN."""
    table = table[np.isfinite(table).all(axis=1)].astype(np.float64)
    ring = table[:, 4:]
    sizes = np.abs(table).mean(axis=0) if len(table) else np.zeros(table.shape[1])
    return bool(
        (np.abs(table[:, :3]) <= FARTHEST_SCANNED).all()
        and (table[:, 3:] >= 0).all()
        and (ring < MOST_RINGS).all()
        and (ring == np.round(ring)).all()
        and sizes.max() > LEAST_CONTRAST * sizes.min()
    )


TABLE_READERS: dict[str, Callable[[Path], np.ndarray]] = {
    **dict.fromkeys((".npy", ".npz"), _numpy_file),
    **dict.fromkeys((".xyz", ".csv", ".txt", ".asc", ".pts"), _text),
    ".bin": _scanner_bin,
}


def read_table(path: Path) -> np.ndarray:
    """Return the points (P, 3) float64 of a file of `TABLE_READERS`, in its unit; InputError for anything else."""
    require_file(path, "no such file", COLUMNS_REMEDY)
    return TABLE_READERS[path.suffix.lower()](path)


SUFFIXES, PATTERNS = (".pcd",), ("**/*.pcd",)


def require_entry(entry: dict, folder: Path) -> None:
    """Raise an InputError unless the files that the entry names are there; reads none."""
    files_in(folder, entry.get("files") or PATTERNS, SUFFIXES)


def from_entry(entry: dict, folder: Path) -> Iterator[Surface]:
    """Yield `views_per_instance` (default 6) views of each instance in PCD files, spread evenly."""
    scale, most = meters_per(entry.get("unit", "m")), entry.get("views_per_instance", 6)
    paths = sorted(files_in(folder, entry.get("files") or PATTERNS, SUFFIXES), key=lambda path: view_order(path.stem))
    for _, group in groupby(paths, key=lambda path: instance_of(path.stem)):
        for path in evenly(list(group), most):
            require_file(path, "no such file", "check files in the config")
            points = parse_pcd(path.read_bytes(), path)
            points = points[~np.isnan(points).any(axis=1)]  # missing depth; infinity is a fault
            require_points(points, path)
            yield Surface(path.stem, points * scale, None)
