"""Reading and writing: whole files or none, arrays without pickles, every fault said in one line."""

from __future__ import annotations

import hashlib
import io
import math
import os
import shutil
import warnings
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING

import numpy as np

from gpca.errors import InputError
from gpca.limits import LARGEST_NUMBER, is_bounded, require_file, require_memory

if TYPE_CHECKING:
    import pandas as pd

TEXT, WHOLE, REAL = "U", "iu", "iuf"  # what an array holds, in the letters of NumPy
_KNOWN = f"b{REAL}{TEXT}"
_LONGEST_HEADER = 10_000  # bytes; NumPy parses none that is longer


MOST_PIXELS = 2**26  # of an image; depth cameras have a tenth of that, and a few bytes may unpack to any number
IMAGE_FORMATS = ("PNG", "JPEG", "TIFF")  # Pillow knows others by their content, and runs programs for some


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path beside `path`; on success it is renamed to `path`, on failure removed.

    A reader therefore never sees half a file, and a killed run leaves the old one in place. The half that it may leave
    beside it has a fixed name, so whoever writes the file next replaces it; no two jobs of a workflow write one file.
    The temporary name keeps the suffix, because several writers choose their format by it.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".{path.stem}.partial{path.suffix}")
    try:
        yield partial
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def require_outputs(outputs: Iterable[str | Path], inputs: Iterable[str | Path] = (), folders: bool = False) -> None:
    """Check, before the work, that files can be written when it is done, and that none of them is what it starts from.

    Args:
        outputs: of the work; a folder that is missing on the way to one of them is made by whoever writes it.
        inputs: of the work.
        folders: the outputs are folders.

    Raises:
        InputError: two outputs, or an output and an input, are the same file; an output is a folder where it should be
            a file, lies below something that is no folder, or in a folder that may not be written to.
    """
    taken = {Path(os.path.realpath(path)) for path in inputs}
    for output in map(Path, outputs):
        if (place := Path(os.path.realpath(output))) in taken:
            raise InputError(output, "is an input, or another output, too", "give each file a name of its own")
        taken.add(place)
        if place.exists() and not (place.is_dir() if folders else place.is_file()):  # a device would be replaced
            raise InputError(output, f"is there and no {'folder' if folders else 'file'}", "give another name")
        existing = next(folder for folder in place.parents if os.path.lexists(folder))
        if not existing.is_dir():
            raise InputError(output, f"cannot be written: {existing} is no folder", "give another name")
        # Root may write to /proc, as far as permissions tell.
        if not os.access(existing, os.W_OK | os.X_OK) or existing.is_relative_to("/proc"):
            raise InputError(output, f"cannot be written: {existing} may not be written to", "give another folder")


@contextmanager
def whole_folder(path: str | Path) -> Iterator[Path]:
    """Yield a temporary folder beside `path`; on success it takes the place of `path`, on failure it is removed."""
    path = Path(path)
    partial = path.with_name(f".{path.name}.partial")
    shutil.rmtree(partial, ignore_errors=True)  # what a killed run left
    partial.mkdir(parents=True)
    try:
        yield partial
        shutil.rmtree(path, ignore_errors=True)
        partial.replace(path)
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def sha256_of_file(path: str | Path) -> str:
    """Return the hexadecimal SHA-256 of a file of any size."""
    with Path(path).open("rb") as content:
        return hashlib.file_digest(content, "sha256").hexdigest()


def read_image(path: str | Path, remedy: str) -> np.ndarray:
    """Return the pixels of an image, (H, W) or (H, W, channels), of the file's own depth.

    Raises:
        InputError: missing, truncated, unreadable or too large; it ends with the remedy.
    """
    from PIL import Image

    if not Path(path).is_file():
        raise InputError(path, "no such image", remedy)
    too_many = f"has more than {MOST_PIXELS} pixels, too many for a frame"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            image = Image.open(path, formats=IMAGE_FORMATS)
        with image:
            if image.width * image.height > MOST_PIXELS:
                raise InputError(path, too_many, remedy)
            return np.asarray(image)
    except InputError:
        raise
    except (Image.DecompressionBombError, Image.DecompressionBombWarning) as fault:
        raise InputError(path, too_many, remedy) from fault
    except Exception as fault:  # Pillow raises errors of many kinds for a damaged file
        raise InputError(path, "is truncated or no readable image", remedy) from fault


def save_arrays(path: str | Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write an npz whose bytes depend on the arrays alone (NumPy stamps every member 1980-01-01)."""
    with whole_file(path) as partial:
        np.savez(partial, allow_pickle=False, **arrays)


def load_arrays(
    path: str | Path, shapes: Mapping[str, tuple[int | str, ...]], made_by: str, kinds: Mapping[str, str] | None = None
) -> dict[str, np.ndarray]:
    """Load the arrays of an npz that a stage needs, and no others.

    What their headers say is checked before any data is read, so that a small file cannot fill the memory.

    Args:
        path: the file.
        shapes: for each needed array its shape; a number must match, a letter (``"S"``) must be the
            same size wherever it occurs.
        made_by: the command that writes such a file; named in the message.
        kinds: for some of them what they may hold: `TEXT`, `WHOLE` or `REAL`. Any other may hold each of these.

    Raises:
        InputError: missing or unreadable file, pickled objects, missing array, wrong shape or type, more than the
            machine can hold, NaN, infinity, or numbers beyond all that can be measured.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(path, "no such file", f"make it with '{made_by}'")
    remedy = f"make it anew with '{made_by}'"
    try:
        with zipfile.ZipFile(path) as archive:
            members = _checked_members(archive, path, shapes, kinds or {}, remedy)
            arrays = {name: _read_array(archive, info) for name, info in members.items()}
    except InputError:
        raise
    except Exception as fault:  # numpy and zipfile raise errors of many kinds for a damaged archive
        raise InputError(path, "is not a readable npz archive", remedy) from fault
    for name, array in arrays.items():
        if array.dtype.kind == "f" and not (np.abs(array) <= LARGEST_NUMBER).all():
            found = "NaN or infinity" if not np.isfinite(array).all() else f"numbers above {LARGEST_NUMBER:.0e}"
            raise InputError(path, f"array '{name}' holds {found}", remedy)
    return arrays


def _checked_members(archive, path, shapes, kinds, remedy) -> dict[str, zipfile.ZipInfo]:
    """Return the member of each array, once its header is found to be right."""
    listed = archive.namelist()
    sizes: dict[str, int] = {}
    members = {}
    for name, shape in shapes.items():
        if (count := listed.count(f"{name}.npy")) != 1:
            raise InputError(path, f"array '{name}' is {'there twice' if count else 'missing'}", remedy)
        members[name] = info = archive.getinfo(f"{name}.npy")
        if not is_bounded(info):
            raise InputError(path, f"array '{name}' is compressed in a way that npz does not know", remedy)
        with archive.open(info) as stream:
            actual, dtype, start = _npy_header(stream)
        if dtype.hasobject:
            raise InputError(path, "holds pickled objects, which are never loaded", remedy)
        _check_shape(path, name, actual, shape, sizes, remedy)
        if math.prod(actual) and dtype.kind not in kinds.get(name, _KNOWN):
            raise InputError(path, f"array '{name}' is of type {dtype}", remedy)
        if start + math.prod(actual) * dtype.itemsize != info.file_size:
            raise ValueError(f"array '{name}' is not as long as its header says")
    require_memory(sum(info.file_size for info in members.values()), path.stat().st_size, path, remedy)
    return members


def _npy_header(stream: IO[bytes]) -> tuple[tuple[int, ...], np.dtype, int]:
    """Return shape, type and length of the header of a member; it may claim to be gigabytes long itself."""
    head = io.BytesIO(stream.read(_LONGEST_HEADER))
    version = np.lib.format.read_magic(head)
    read = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}[version]
    shape, _, dtype = read(head)
    return shape, dtype, head.tell()


def _read_array(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> np.ndarray:
    with archive.open(info) as stream:
        return np.lib.format.read_array(stream, allow_pickle=False)


def _check_shape(path, name, actual, shape, sizes, remedy) -> None:
    matches = len(actual) == len(shape) and all(
        sizes.setdefault(size, found) == found if isinstance(size, str) else size == found
        for size, found in zip(shape, actual, strict=True)
    )
    if not matches:
        expected = "×".join(str(sizes.get(size, size)) for size in shape) or "scalar"
        raise InputError(path, f"array '{name}' is {'×'.join(map(str, actual)) or 'scalar'}, not {expected}", remedy)


def read_csv(path: str | Path, columns: Iterable[str]) -> pd.DataFrame:
    """Read a CSV file with at least these columns and one row, every entry as the text that stands there.

    Raises:
        InputError: missing, empty or unreadable file, column that is missing or there twice, no rows, rows longer than
            the head.
    """
    import pandas as pd

    require_file(path, "no such file", "make it with snakemake")
    try:
        rows = pd.read_csv(path, dtype=str, keep_default_na=False)
    except pd.errors.EmptyDataError as fault:
        raise InputError(path, "is empty", "make it anew") from fault
    except (pd.errors.ParserError, UnicodeDecodeError, OSError) as fault:
        raise InputError(path, f"is not a readable CSV file ({fault})", "make it anew") from fault
    missing = [column for column in columns if column not in rows.columns]
    if missing:
        raise InputError(path, f"column '{missing[0]}' is missing", "make it anew")
    if not isinstance(rows.index, pd.RangeIndex):  # pandas takes what is too much for an index, and shifts the rest
        raise InputError(path, "has rows with more entries than columns", "make it anew")
    # pandas gives the second of two columns another name, so the head is read once more as it stands.
    head = pd.read_csv(path, dtype=str, keep_default_na=False, header=None, nrows=1).iloc[0]
    if (twice := head[head.duplicated()]).size:
        raise InputError(path, f"column '{twice.iloc[0]}' is there twice", "make it anew")
    if rows.empty:
        raise InputError(path, "holds no rows", "make it anew")
    return rows


def numbers(path: str | Path, rows: pd.DataFrame, column: str, needed=True, least: float = -np.inf) -> pd.Series:
    """Return a column as float64; NaN where it is not `needed` and no number.

    Raises:
        InputError: no number where one is needed; a number below `least`.
    """
    import pandas as pd

    values = pd.to_numeric(rows[column], errors="coerce").astype(float)
    if (~np.isfinite(values) & needed).any():
        raise InputError(path, f"column '{column}' holds something that is not a finite number", "make it anew")
    if (values < least).any():
        raise InputError(path, f"column '{column}' holds numbers below {least:g}", "make it anew")
    return values


def write_csv(path: str | Path, frame: pd.DataFrame) -> None:
    """Write a CSV file, whole or not at all, with six decimals."""
    with whole_file(path) as partial:
        frame.to_csv(partial, index=False, float_format="%.6f", lineterminator="\n")
