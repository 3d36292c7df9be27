"""Points as tables of numbers: NumPy's npy and npz, text (xyz, csv), and KITTI's bin.

The first three columns are x, y and z, whatever follows; of a csv with a header, those that are named so. All readers
return (P, 3) float64 in the file's unit, and raise an InputError in one line for anything else.
"""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.io.limits import require_file, require_memory
from gpca.objects.mesh_text import LARGEST_TEXT_BYTES

AXES = ("x", "y", "z")
# What the array of points is called in an npz that holds others too, most usual first.
NAMES = ("points", "xyz", "positions", "pos", "coords", "vertices", "pcd", "cloud", "data")
KITTI_COLUMNS = 4  # x, y, z and the intensity, float32
SEPARATORS = (",", ";", "\t")
FARTHEST_KITTI = 1e4  # meters; no such scanner sees so far, so the file holds something else
REMEDY = "export it as three columns x, y, z"


def read_table(path: Path) -> np.ndarray:
    """Return the points (P, 3) of a file of one of the formats in `READERS`, by its suffix."""
    require_file(path, "no such file", REMEDY)
    return READERS[path.suffix.lower()](path)


def _npy(path: Path) -> np.ndarray:
    return _points_of(_loaded(path), path)


def _npz(path: Path) -> np.ndarray:
    archive = _loaded(path)
    with archive:
        names = [name for name in NAMES if name in archive.files] or archive.files
        if not names:
            raise InputError(path, "holds no array", REMEDY)
        if len(names) > 1 and names == archive.files:
            known = ", ".join(archive.files[:8])
            raise InputError(path, f"holds several arrays ({known}), none of them named 'points'", "rename one")
        try:
            array = archive[names[0]]
        except Exception as fault:  # numpy and zipfile raise errors of many kinds for a damaged archive
            raise InputError(path, f"array '{names[0]}' cannot be read ({fault})", "save it again") from fault
    return _points_of(array, path)


def _loaded(path: Path):
    try:
        if path.suffix.lower() == ".npz":
            _require_small(path)
        return np.load(path, allow_pickle=False)
    except InputError:
        raise
    except Exception as fault:
        raise InputError(path, f"is not a readable {path.suffix} file ({fault})", "save it again") from fault


def _require_small(path: Path) -> None:
    import zipfile

    with zipfile.ZipFile(path) as archive:
        size = sum(info.file_size for info in archive.infolist())
    require_memory(size, path.stat().st_size, path, "save it again")


def _points_of(array: np.ndarray, path: Path) -> np.ndarray:
    if array.dtype.names:
        if not set(AXES) <= set(array.dtype.names):
            raise InputError(path, f"has the fields {', '.join(array.dtype.names[:8])}, not x, y, z", REMEDY)
        array = np.stack([np.asarray(array[axis], np.float64).ravel() for axis in AXES], axis=1)
    if array.dtype.kind not in "iuf":
        raise InputError(path, f"holds values of type {array.dtype}, not numbers", REMEDY)
    if array.ndim == 3 and array.shape[2] == 3:  # one point per pixel, without one where depth is missing
        array = array.reshape(-1, 3)
        array = array[np.isfinite(array).all(axis=1)]
    wrong = array.ndim == 2 and array.shape[0] == 3 != array.shape[1]  # three points are no cloud
    if array.ndim != 2 or array.shape[1] < 3 or wrong:
        raise InputError(path, f"has the shape {array.shape}, not (N, 3)", "transpose it" if wrong else REMEDY)
    return np.ascontiguousarray(array[:, :3], np.float64)


def _text(path: Path) -> np.ndarray:
    """Read columns that are parted by spaces, commas, semicolons or tabs; lines that begin with # are comments."""
    require_file(path, "no such file", REMEDY, LARGEST_TEXT_BYTES)
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    kept = [line for line in lines if line.strip() and not line.lstrip().startswith(("#", "//"))]
    if not kept:
        raise InputError(path, "has no points", REMEDY)
    separator = next((sign for sign in SEPARATORS if sign in kept[0]), None)
    columns, body = _columns(kept, separator, path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of a table without rows
            text = io.StringIO("\n".join(body))
            table = np.loadtxt(text, np.float64, delimiter=separator, ndmin=2, usecols=columns, comments=None)
    except (ValueError, IndexError) as fault:
        raise InputError(path, f"is no table of numbers ({fault})", REMEDY) from fault
    if table.shape[1] != 3 or not len(table):
        raise InputError(path, "has no points", REMEDY)
    return table


def _columns(lines: list[str], separator: str | None, path: Path) -> tuple[tuple[int, ...], list[str]]:
    """Return which columns are x, y, z, and the lines below a header, if there is one."""
    words = [word.strip().strip('"').lower() for word in lines[0].split(separator)]
    if not any(map(_is_number, words)):
        if not set(AXES) <= set(words):
            raise InputError(path, f"has the columns {', '.join(words[:8])}, not x, y, z", REMEDY)
        return tuple(words.index(axis) for axis in AXES), lines[1:]
    if len(words) == 1 and len(lines) > 1 and _is_number(words[0]):  # how many points follow
        return (0, 1, 2), lines[1:]
    if len(words) < 3:
        raise InputError(path, f"has {len(words)} columns", REMEDY)
    return (0, 1, 2), lines


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _kitti(path: Path) -> np.ndarray:
    values = np.fromfile(path, "<f4")
    if path.stat().st_size % (4 * KITTI_COLUMNS):
        fault = f"has {path.stat().st_size} bytes, which are no rows of 4 float32 (x, y, z, intensity)"
        raise InputError(path, fault, "give a scan of KITTI, or save it as npy")
    points = values.reshape(-1, KITTI_COLUMNS)[:, :3].astype(np.float64)
    with np.errstate(invalid="ignore"):
        if not (np.abs(points) <= FARTHEST_KITTI).all():
            fault = "holds no rows of 4 float32 (x, y, z, intensity) in meters, as scans of KITTI do"
            raise InputError(path, fault, "save it as npy")
    return points


READERS: dict[str, Callable[[Path], np.ndarray]] = {
    ".npy": _npy,
    ".npz": _npz,
    ".xyz": _text,
    ".csv": _text,
    ".bin": _kitti,
}
