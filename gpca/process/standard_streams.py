"""Output of a command that arrives in any encoding, with an error wherever some of it is lost."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO

from gpca.errors import InputError


@contextmanager
def standard_streams() -> Iterator[None]:
    """Run a command whose prints need not fit the encoding, and see that all of them left the process.

    A letter that the encoding lacks is printed as an escape such as ``\\xb0``.

    Raises:
        InputError: stdout is closed, its reader is gone, or its disk is full.
    """
    if sys.stdout is None:
        raise InputError("stdout", "is closed", "redirect it, for example to /dev/null")
    if sys.stderr is None:  # else what is meant for it would be printed to stdout
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    for stream in (sys.stdin, sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    try:
        yield
    finally:
        try:
            sys.stdout.flush()
        except OSError as fault:
            _discard(sys.stdout)
            raise InputError("stdout", f"cannot be written ({fault.strerror})", "redirect it to a file") from fault


def say(line: str) -> None:
    """Print a line to stderr; where that fails, the status of the process has to suffice."""
    try:
        print(line, file=sys.stderr, flush=True)
    except OSError:
        _discard(sys.stderr)


def _discard(stream: TextIO) -> None:
    """Drop what a stream still holds: Python flushes once more when it ends, and would complain in its own words."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
