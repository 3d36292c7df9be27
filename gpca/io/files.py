"""Files and folders: written whole or not at all, checked before the work; and images."""

from __future__ import annotations

import hashlib
import os
import shutil
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.io.limits import require_file

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
            raise InputError(output, "is also an input or another output", "give each file its own name")
        taken.add(place)
        if place.exists() and not (place.is_dir() if folders else place.is_file()):  # a device would be replaced
            raise InputError(output, f"exists but is not a {'folder' if folders else 'file'}", "choose another name")
        existing = next(folder for folder in place.parents if os.path.lexists(folder))
        if not existing.is_dir():
            raise InputError(output, f"cannot be written: {existing} is not a folder", "choose another name")
        # Root may write to /proc, as far as permissions tell.
        if not os.access(existing, os.W_OK | os.X_OK) or existing.is_relative_to("/proc"):
            raise InputError(
                output, f"cannot be written: no permission to write to {existing}", "choose another folder"
            )


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
    require_file(path, "no such image", remedy)
    from PIL import Image

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
        raise InputError(path, "is truncated or not a readable image", remedy) from fault
