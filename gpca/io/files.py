"""Files: readable within limits, written whole or not at all, named, and images.

A small file may claim to be large, or unpack to a large one, so sizes are checked before anything is read. Files of
another source or seed often have the same shapes, so the step that makes a file writes them, and readers check them.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING
from unicodedata import category

from gpca.errors import InputError

if TYPE_CHECKING:
    import numpy as np

LARGEST_FILE_BYTES = 10**9  # twice Stanford's Lucy of 28 million triangles; parsing takes several times the size
# A compressed archive may hold this multiple of its size, or SMALL_BYTES. Measured numbers shrink to a half at best and
# masks to a twentieth.
LARGEST_RATIO = 20
SMALL_BYTES = 2**28
MOST_PIXELS = 2**26  # of an image, ten times a depth camera's
IMAGE_FORMATS = ("PNG", "JPEG", "TIFF")  # Pillow knows others by their content, and runs programs for some
SPLITS = ("train", "test")
Axes = tuple[str, int | None]  # source and seed; the objects of a source have no seed
_BREAKS = ("Cc", "Zl", "Zp")  # control characters, and separators of lines and paragraphs


def require_file(path: str | Path, fault: str, remedy: str, largest_bytes: float = LARGEST_FILE_BYTES) -> None:
    """Raise an InputError unless a user's file can be read to its end; all readers of users' files call this.

    Reading a device, a pipe, or an empty file of the kernel, as in /proc, may never end. `fault` is the message for a
    missing file, `largest_bytes` what its reader can parse.
    """
    try:
        status = os.stat(path)
        if stat.S_ISREG(status.st_mode) and status.st_size:
            os.close(os.open(path, os.O_RDONLY))
    except (FileNotFoundError, NotADirectoryError) as missing:
        raise InputError(path, fault, remedy) from missing
    except (OSError, ValueError) as denied:  # no permission, a loop of links, an impossible name
        reason = getattr(denied, "strerror", None) or denied
        raise InputError(path, f"cannot be read ({reason})", "correct its name or permissions") from denied
    if not stat.S_ISREG(status.st_mode):
        kind = "a folder" if stat.S_ISDIR(status.st_mode) else "a device, pipe or socket"
        raise InputError(path, f"is {kind}, not a file", remedy)
    if not status.st_size:
        raise InputError(path, "is empty", remedy)
    if status.st_size > largest_bytes:
        raise InputError(path, f"is {_size(status.st_size)}, more than the limit of {_size(largest_bytes)}", remedy)


def _size(number_of_bytes: float) -> str:
    scale, unit = (1e9, "GB") if number_of_bytes >= 1e9 else (1e6, "MB")
    return f"{number_of_bytes / scale:.3g} {unit}"


def require_memory(needed_bytes: int, file_bytes: int, subject: object, remedy: str) -> None:
    """Raise an InputError unless a file can plausibly hold what it says, and half of the machine's memory can."""
    if needed_bytes > max(SMALL_BYTES, LARGEST_RATIO * file_bytes):
        fault = f"would unpack to {needed_bytes / 1e9:.3g} GB, more than {LARGEST_RATIO} times its size"
        raise InputError(subject, fault, remedy)
    memory_bytes = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    if needed_bytes > memory_bytes / 2:
        fault = f"takes {needed_bytes / 1e9:.3g} GB, more than half of this machine's {memory_bytes / 1e9:.3g} GB"
        raise InputError(subject, fault, "use a machine with more memory, or smaller data")


def is_name(text: str) -> bool:
    """Return whether a text is not blank and fits on a line."""
    return bool(text.strip()) and not any(category(character) in _BREAKS for character in text)


def _in_words(axes: Axes) -> str:
    source, seed = axes
    return f"source '{source}'" + ("" if seed is None else f", seed {seed}")


def require_axes(path: str | Path, actual: Axes, expected: Axes | None) -> None:
    """Raise an InputError unless a file has the expected source and seed; None accepts any."""
    if expected is not None and actual != expected:
        wanted = _in_words(expected)
        raise InputError(path, f"is of {_in_words(actual)}, not of {wanted}", f"give the file of {wanted}")


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path beside `path`, with its suffix, renamed to `path` on success and removed on failure.

    A killed run leaves the old file, and a partial one with a fixed name that the next writer replaces.
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
    """Check before the work that outputs can be written, and that none of them is an input; folders may be missing."""
    taken = {Path(os.path.realpath(path)) for path in inputs}
    for output in map(Path, outputs):
        if (real := Path(os.path.realpath(output))) in taken:
            raise InputError(output, "is also an input or another output", "give each file its own name")
        taken.add(real)
        if real.exists() and not (real.is_dir() if folders else real.is_file()):  # a device would be replaced
            raise InputError(output, f"exists but is not a {'folder' if folders else 'file'}", "choose another name")
        existing = next(folder for folder in real.parents if os.path.lexists(folder))
        if not existing.is_dir():
            raise InputError(output, f"cannot be written: {existing} is not a folder", "choose another name")
        # Permissions let root write to /proc, which fails.
        if not os.access(existing, os.W_OK | os.X_OK) or existing.is_relative_to("/proc"):
            raise InputError(
                output, f"cannot be written: no permission to write to {existing}", "choose another folder"
            )


@contextmanager
def whole_folder(path: str | Path) -> Iterator[Path]:
    """Yield a temporary folder beside `path`, which replaces `path` on success and is removed on failure."""
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
    """Return the pixels of an image, (H, W) or (H, W, channels), in the file's depth; InputError for a damaged one."""
    require_file(path, "no such image", remedy)
    import numpy as np
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
