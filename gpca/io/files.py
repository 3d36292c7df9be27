"""Files: readable within limits, written whole or not at all, named, and images."""

from __future__ import annotations

import csv
import errno
import fcntl
import hashlib
import io
import os
import shutil
import stat
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING
from unicodedata import category

from gpca.errors import InputError, refusing

if TYPE_CHECKING:
    from argparse import Namespace

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
PAGE = ".html"
LONGEST_TITLE = 200
FEW_BYTES = 2**16  # of a full disk
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
# Control characters, separators of lines and paragraphs, and bytes that are not of UTF-8.
_BREAKS = ("Cc", "Zl", "Zp", "Cs")


def require_file(path: str | Path, fault: str, remedy: str, largest_bytes: float = LARGEST_FILE_BYTES) -> None:
    """Raise an InputError unless a user's file can be read to its end, which devices and pipes may not have."""
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


def is_title(text: str) -> bool:
    return is_name(text) and len(text) <= LONGEST_TITLE


def require_axes(path: str | Path, actual: Axes, expected: Axes | None) -> None:
    if expected is not None and actual != expected:
        each = ((f"source '{source}'", f", seed {seed}" * (seed is not None)) for source, seed in (actual, expected))
        found, wanted = map("".join, each)
        raise InputError(path, f"is of {found}, not of {wanted}", f"give the file of {wanted}")


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path beside `path`, locked, renamed to it on success and removed on failure."""
    path = Path(path)
    with full_disk_named(path), _alone(path.with_name(f".{path.stem}.partial{path.suffix}")) as partial:
        yield partial
        partial.replace(path)


@contextmanager
def whole_folder(path: str | Path) -> Iterator[Path]:
    """Yield a temporary folder beside `path`, which replaces `path` on success and is removed on failure."""
    path = Path(path)
    with full_disk_named(path), _alone(path.with_name(f".{path.name}.partial"), folder=True) as partial:
        yield partial
        shutil.rmtree(path, ignore_errors=True)
        partial.replace(path)


@contextmanager
def _alone(partial: Path, folder: bool = False) -> Iterator[Path]:
    """Make a file or folder, empty and locked, that is removed if the block fails."""
    partial.parent.mkdir(parents=True, exist_ok=True)
    while True:
        if folder:
            partial.mkdir(exist_ok=True)
        locked = os.open(partial, os.O_NOFOLLOW | (os.O_RDONLY if folder else os.O_RDWR | os.O_CREAT), 0o666)
        with suppress(OSError):  # a file system without locks
            fcntl.flock(locked, fcntl.LOCK_EX)
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(locked), os.lstat(partial)):
                break
        os.close(locked)  # the other writer has renamed it
    try:
        if folder:
            for left in partial.iterdir():  # by a killed run
                shutil.rmtree(left) if left.is_dir() and not left.is_symlink() else left.unlink()
        else:
            os.truncate(locked, 0)
        yield partial
    except BaseException:
        shutil.rmtree(partial, ignore_errors=True) if folder else partial.unlink(missing_ok=True)
        raise
    finally:
        os.close(locked)


@contextmanager
def full_disk_named(path: Path) -> Iterator[None]:
    """Raise an InputError that names what was to be written if the disk is full; some libraries do not tell."""
    try:
        yield
    except (OSError, RuntimeError) as fault:
        folder = next(each for each in path.absolute().parents if each.is_dir())
        if getattr(fault, "errno", None) not in _FULL and shutil.disk_usage(folder).free > FEW_BYTES:
            raise
        words = f"cannot be written: no space left on the disk of {folder}"
        raise InputError(path, words, "free some, or name a place on another") from fault


def printable(text: object) -> str:
    """Return a text, such as a path, with escapes for what UTF-8 cannot hold: bytes of another encoding."""
    return str(text).encode("utf-8", "backslashreplace").decode("utf-8")


def write_text(path: str | Path, text: str) -> None:
    with whole_file(path) as partial:
        partial.write_text(printable(text), encoding="utf-8")


def append_row(path: Path, row: Sequence[object], head: Sequence[object]) -> None:
    """Add a row to a CSV, after the head if it is empty, whole or not at all; others may do so at the same time."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with full_disk_named(path), path.open("ab+", buffering=0) as file:
        with suppress(OSError):  # a file system without locks
            fcntl.flock(file, fcntl.LOCK_EX)
        end = file.seek(0, os.SEEK_END)
        file.seek(max(0, end - 1))
        text = io.StringIO()
        text.write("\n" * (file.read(1) not in (b"", b"\n")))
        csv.writer(text, lineterminator="\n").writerows([row] if end else [head, row])
        content = text.getvalue().encode()
        try:
            if file.write(content) != len(content):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError:
            file.truncate(end)
            raise


def require_apart(options: Namespace, outputs: Iterable[str], also_read: Iterable[str | Path] = ()) -> None:
    """Check before the work that a command can write its outputs, named as options, and reads none of them."""
    given = vars(options) | dict.fromkeys(outputs)
    values = [each for value in given.values() for each in (value if isinstance(value, list) else [value])]
    read = [each for each in values if isinstance(each, Path) or (isinstance(each, str) and os.path.isfile(each))]
    require_outputs([path for name in outputs if (path := getattr(options, name))], [*read, *also_read])


def require_outputs(outputs: Iterable[str | Path], inputs: Iterable[str | Path] = (), folders: bool = False) -> None:
    """Check before the work that outputs can be written and are no inputs; of a folder, only pages are replaced."""
    taken = {_real(path) for path in inputs}
    read = [path for path in taken if path.is_dir()]
    for output in map(Path, outputs):
        real = _real(output)
        is_read = real.exists() and real.suffix != PAGE and any(map(real.is_relative_to, read))
        linked = real.is_file() and real.stat().st_nlink > 1 and any(map(real.samefile, filter(Path.exists, taken)))
        if real in taken or is_read or linked:
            raise InputError(output, "is also an input or another output", "give each file its own name")
        taken.add(real)
        if real.exists() and not (real.is_dir() if folders else real.is_file()):  # a device would be replaced
            raise InputError(output, f"exists but is not a {'folder' if folders else 'file'}", "choose another name")
        existing = next(folder for folder in real.parents if os.path.lexists(folder))
        if not existing.is_dir():
            raise InputError(output, f"cannot be written: {existing} is not a folder", "choose another name")
        # Permissions let root write to /proc, which fails.
        if not os.access(existing, os.W_OK | os.X_OK) or existing.is_relative_to("/proc"):
            fault = f"cannot be written: no permission to write to {existing}"
            raise InputError(output, fault, "choose another folder")


def _real(path: str | Path) -> Path:
    try:
        return Path(os.path.realpath(path))
    except ValueError as fault:
        raise InputError(repr(str(path)), f"is no name of a file ({fault})", "correct it") from fault


def require_page(path: Path) -> None:
    """Raise an InputError unless a page is named as one, so that nobody reads it as a table."""
    if path.suffix.lower() != PAGE:
        raise InputError(path, "is the name of no page", f"let it end in {PAGE}")


def sha256_of_file(path: str | Path) -> str:
    with Path(path).open("rb") as content:
        return hashlib.file_digest(content, "sha256").hexdigest()


def read_image(path: str | Path, remedy: str) -> np.ndarray:
    """Return the pixels of an image, (H, W) or (H, W, channels), in the file's depth; InputError for a damaged one."""
    require_file(path, "no such image", remedy)
    import numpy as np
    from PIL import Image

    Image.MAX_IMAGE_PIXELS = None  # of which it would warn
    damaged = refusing(path, "is truncated or not a readable image ({})", remedy)
    with damaged, Image.open(path, formats=IMAGE_FORMATS) as image:
        pixels = np.asarray(image) if image.width * image.height <= MOST_PIXELS else None
    if pixels is None:
        raise InputError(path, f"has more than {MOST_PIXELS} pixels, too many for a frame", remedy)
    return pixels
