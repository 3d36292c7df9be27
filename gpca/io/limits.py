"""Limits of reading into memory: enough for users' files, but no more than the machine can hold.

A small file may say that it is a large one, or unpack to one. So sizes are looked at before anything is read.
"""

from __future__ import annotations

import os
import stat
import zipfile
from pathlib import Path

from gpca.errors import InputError

# Of a file that is parsed as a whole. The largest scan in common use, Stanford's Lucy of 28 million triangles, takes
# half of it, and parsing takes several times the size of the file.
LARGEST_FILE_BYTES = 10**9
# A compressed archive may hold so many times its own size, or so much in any case. Measured numbers shrink to a half at
# best and masks to a twentieth; what shrinks further is small, or made to fill the memory.
LARGEST_RATIO = 20
SMALL_BYTES = 2**28
# Squares of larger numbers leave the range of float32. Nothing that the suite measures comes near.
LARGEST_NUMBER = 1e15
_BOUNDED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


def require_file(path: str | Path, fault: str, remedy: str, largest_bytes: float = LARGEST_FILE_BYTES) -> None:
    """Raise an InputError unless a file of a user's can be read to its end; every reader of such files calls this.

    Reading a device or a pipe may never end, and nor may reading what the kernel shows as an empty file, as in /proc.

    Args:
        path: the file.
        fault: the message where there is none.
        remedy: the advice.
        largest_bytes: that its reader can parse.
    """
    try:
        status = os.stat(path)
        if stat.S_ISREG(status.st_mode) and status.st_size:
            os.close(os.open(path, os.O_RDONLY))
    except (FileNotFoundError, NotADirectoryError) as missing:
        raise InputError(path, fault, remedy) from missing
    except (OSError, ValueError) as denied:  # no permission, a loop of links, a name that can be none
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
    """Raise an InputError unless a file of `file_bytes` may well hold so much, and the machine can.

    Half of the physical memory is the limit: data is checked, cut and converted, which takes as much again.
    """
    if needed_bytes > max(SMALL_BYTES, LARGEST_RATIO * file_bytes):
        fault = f"would unpack to {needed_bytes / 1e9:.3g} GB, more than {LARGEST_RATIO} times its size"
        raise InputError(subject, fault, remedy)
    memory_bytes = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    if needed_bytes > memory_bytes / 2:
        fault = f"takes {needed_bytes / 1e9:.3g} GB, more than half of this machine's {memory_bytes / 1e9:.3g} GB"
        raise InputError(subject, fault, "use a machine with more memory, or smaller data")


def is_bounded(info: zipfile.ZipInfo) -> bool:
    """Return whether the member of a zip can be read piece by piece: bzip2 and LZMA give megabytes for a byte."""
    return info.compress_type in _BOUNDED
