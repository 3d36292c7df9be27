"""Reading and writing: whole files or none, arrays without pickles, every fault said in one line."""

from __future__ import annotations

import hashlib
import os
import shutil
import warnings
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.errors import InputError

if TYPE_CHECKING:
    import pandas as pd


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


def load_arrays(path: str | Path, shapes: Mapping[str, tuple[int | str, ...]], made_by: str) -> dict[str, np.ndarray]:
    """Load an npz and check the arrays that a stage needs.

    Args:
        path: the file.
        shapes: for each needed array its shape; a number must match, a letter (``"S"``) must be the
            same size wherever it occurs.
        made_by: the command that writes such a file; named in the message.

    Raises:
        InputError: missing or unreadable file, pickled objects, missing array, wrong shape, NaN or infinity.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(path, "no such file", f"make it with '{made_by}'")
    reason = "is not a readable npz archive"
    if not zipfile.is_zipfile(path):
        raise InputError(path, reason, f"make it anew with '{made_by}'")
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except Exception as fault:  # numpy and zipfile raise errors of many kinds for a damaged archive
        if "pickle" in str(fault).lower():
            reason = "holds pickled objects, which are never loaded"
        raise InputError(path, reason, f"make it anew with '{made_by}'") from fault
    sizes: dict[str, int] = {}
    for name, shape in shapes.items():
        if name not in arrays:
            raise InputError(path, f"array '{name}' is missing", f"make it anew with '{made_by}'")
        _check_array(path, name, arrays[name], shape, sizes, made_by)
    return arrays


def _check_array(path, name, array, shape, sizes, made_by) -> None:
    matches = array.ndim == len(shape) and all(
        sizes.setdefault(size, actual) == actual if isinstance(size, str) else size == actual
        for size, actual in zip(shape, array.shape, strict=True)
    )
    if not matches:
        expected = "×".join(str(sizes.get(size, size)) for size in shape) or "scalar"
        actual = "×".join(map(str, array.shape)) or "scalar"
        raise InputError(path, f"array '{name}' is {actual}, not {expected}", f"make it anew with '{made_by}'")
    if np.issubdtype(array.dtype, np.floating) and not np.isfinite(array).all():
        raise InputError(path, f"array '{name}' holds NaN or infinity", f"make it anew with '{made_by}'")


def read_csv(path: str | Path, columns: Iterable[str]) -> pd.DataFrame:
    """Read a CSV file with at least these columns and one row, every entry as the text that stands there.

    Raises:
        InputError: missing, empty or unreadable file, column that is missing or there twice, no rows, rows longer than
            the head.
    """
    import pandas as pd

    try:
        rows = pd.read_csv(path, dtype=str, keep_default_na=False)
    except FileNotFoundError as fault:
        raise InputError(path, "no such file", "make it with snakemake") from fault
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


def numbers(path: str | Path, rows: pd.DataFrame, column: str, needed=True) -> pd.Series:
    """Return a column as float64; NaN where it is not `needed` and no number. InputError where it is needed."""
    import pandas as pd

    values = pd.to_numeric(rows[column], errors="coerce").astype(float)
    if (~np.isfinite(values) & needed).any():
        raise InputError(path, f"column '{column}' holds something that is not a finite number", "make it anew")
    return values


def write_csv(path: str | Path, frame: pd.DataFrame) -> None:
    """Write a CSV file, whole or not at all, with six decimals."""
    with whole_file(path) as partial:
        frame.to_csv(partial, index=False, float_format="%.6f", lineterminator="\n")
