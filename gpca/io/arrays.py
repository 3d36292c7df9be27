"""Arrays in npz files: without pickles, of a known source and seed, and no more than the memory can hold."""

import io
import math
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gpca.errors import InputError, refusing
from gpca.io.files import SPLITS, Axes, is_name, require_axes, require_file, require_memory, whole_file
from gpca.numerals import LARGEST_NUMBER

REGENERATE = "regenerate it with Snakemake"
TEXT, WHOLE, REAL = "U", "iu", "iuf"  # what an array holds, in the letters of NumPy
_BOUNDED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # bzip2 and LZMA may give megabytes for a byte
_KNOWN = f"b{REAL}{TEXT}"
_FLOAT_BYTES = (4, 8)
_LONGEST_HEADER = 10_000  # bytes; NumPy parses none that is longer
_HEADERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}


def save_arrays(path: str | Path, arrays: Mapping[str, np.ndarray], axes: Axes | None = None) -> None:
    """Write an npz of the arrays, ``source`` and ``seed``; equal ones give equal bytes."""
    with whole_file(path) as partial:
        write_arrays(partial, arrays, axes)


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray], axes: Axes | None = None) -> None:
    source, seed = axes or (None, None)
    of = {name: np.array(value) for name, value in (("source", source), ("seed", seed)) if value is not None}
    np.savez(path, allow_pickle=False, **arrays, **of)


def load_arrays(
    path: str | Path,
    shapes: Mapping[str, tuple[int | str, ...]],
    kinds: Mapping[str, str] | None = None,
    axes: Axes | None = None,
    remedy: str = REGENERATE,
) -> dict[str, np.ndarray]:
    """Load the arrays of an npz that a stage needs, and no others.

    Headers are checked before any data is read, so that a small file cannot fill the memory. In `shapes`, a name as
    ``"S"`` is the same size wherever it occurs, and ``"S+1"`` one more; `kinds` say what some hold, `axes` the source
    and seed that the file has to be of. InputError for a damaged file, and values that are wrong in any array.
    """
    path = Path(path)
    require_file(path, "no such file", "make it with Snakemake", math.inf)
    kinds = dict(kinds or {})
    if axes is not None:
        of = {"source": TEXT} | ({} if axes[1] is None else {"seed": WHOLE})
        shapes, kinds = {**shapes, **dict.fromkeys(of, ())}, kinds | of
    with refusing(path, "is not a readable npz archive", remedy), zipfile.ZipFile(path) as archive:
        members = _checked_members(archive, path, shapes, kinds, remedy)
        arrays = {name: _read(archive, info) for name, info in members.items()}
    for name, array in arrays.items():
        value_fault = None
        if array.dtype.kind == "f" and not (np.abs(array) <= LARGEST_NUMBER).all():
            value_fault = f"numbers above {LARGEST_NUMBER:.0e}" if np.isfinite(array).all() else "NaN or infinity"
        elif array.dtype.kind == TEXT:
            words = set(array.ravel().tolist())
            if not all(is_name(word) for word in words):
                value_fault = "a name that is empty or does not fit on one line"
            elif name == "split" and (unknown := words - set(SPLITS)):
                value_fault = f"the split {min(unknown)!r}, which is neither train nor test"
        if value_fault:
            raise InputError(path, f"array '{name}' contains {value_fault}", remedy)
    if axes is not None and "source" in arrays:
        require_axes(path, axes_in(arrays), axes)
    return arrays


def require_numbers(
    values: object, shape: tuple[int | None, ...], name: str, kinds: str = f"b{REAL}", finite: bool = True
) -> np.ndarray:
    """Return an array of plain numbers from outside code, or raise an InputError; None stands for any size."""
    wanted = "×".join("N" if size is None else str(size) for size in shape)
    fault = ""
    if not isinstance(values, np.ndarray) or isinstance(values, np.matrix | np.ma.MaskedArray):
        fault = f"is of type {type(values).__name__}, not an array of NumPy"
    elif values.dtype.kind not in kinds or values.dtype.itemsize > max(_FLOAT_BYTES):
        fault = f"has type {values.dtype}"
    elif values.ndim != len(shape) or any(b not in (a, None) for a, b in zip(values.shape, shape, strict=True)):
        fault = f"has shape {'×'.join(map(str, values.shape)) or 'scalar'}, not {wanted}"
    elif finite and not (np.abs(values.astype(np.float64)) <= LARGEST_NUMBER).all():
        fault = f"contains NaN, infinity or numbers above {LARGEST_NUMBER:.0e}"
    if fault:
        raise InputError(name, fault, f"give plain numbers, {wanted}")
    assert isinstance(values, np.ndarray)
    return values


def axes_in(arrays: Mapping[str, np.ndarray]) -> Axes:
    return str(arrays["source"]), int(arrays["seed"]) if "seed" in arrays else None


def read_member(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> np.ndarray:
    """Return an array of numbers or flags; a ValueError for any other, and for one that is shorter than it says."""
    _, dtype = _header(archive, info)
    if dtype.kind not in f"b{REAL}" or not dtype.isnative:
        raise ValueError(f"array '{info.filename}' has type {dtype}")
    return _read(archive, info)


def _read(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> np.ndarray:
    with archive.open(info) as stream:
        return np.lib.format.read_array(stream, allow_pickle=False)


def _header(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> tuple[tuple[int, ...], np.dtype]:
    with archive.open(info) as stream:
        head = io.BytesIO(stream.read(_LONGEST_HEADER))  # which may claim to be gigabytes long itself
    shape, _, dtype = _HEADERS[np.lib.format.read_magic(head)](head)
    if not dtype.hasobject and head.tell() + math.prod(shape) * dtype.itemsize != info.file_size:
        raise ValueError(f"array '{info.filename}' is not as long as its header says")
    return shape, dtype


def _checked_members(archive, path, shapes, kinds, remedy) -> dict[str, zipfile.ZipInfo]:
    listed = archive.namelist()
    sizes: dict[str, int] = {}
    members = {}
    for name, shape in shapes.items():
        if (count := listed.count(f"{name}.npy")) != 1:
            raise InputError(path, f"array '{name}' is {'duplicated' if count else 'missing'}", remedy)
        members[name] = info = archive.getinfo(f"{name}.npy")
        if info.compress_type not in _BOUNDED:
            raise InputError(path, f"array '{name}' uses a compression that npz does not support", remedy)
        actual, dtype = _header(archive, info)
        if dtype.hasobject:
            raise InputError(path, "contains pickled objects, which are never loaded", remedy)
        expected: list[int | str] = []
        for number, size in enumerate(shape):
            if isinstance(size, str):
                dimension, _, more = size.partition("+")
                if len(actual) == len(shape):
                    sizes.setdefault(dimension, actual[number] - int(more or 0))
                size = sizes[dimension] + int(more or 0) if dimension in sizes else size
            expected.append(size)
        if list(actual) != expected:
            wanted = "×".join(map(str, expected)) or "scalar"
            raise InputError(path, f"array '{name}' is {'×'.join(map(str, actual)) or 'scalar'}, not {wanted}", remedy)
        if math.prod(actual) and dtype.kind not in kinds.get(name, _KNOWN):
            raise InputError(path, f"array '{name}' has type {dtype}", remedy)
        if (dtype.kind == "f" and dtype.itemsize not in _FLOAT_BYTES) or not dtype.isnative:
            # Half precision has lost digits, and neither torch nor LAPACK calculates with more than double.
            raise InputError(path, f"array '{name}' has type {dtype}, not float32 or float64", remedy)
    require_memory(sum(info.file_size for info in members.values()), path.stat().st_size, path, remedy)
    return members
