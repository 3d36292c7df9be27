"""The one exception for a user's mistake: shown as one line, never as a traceback."""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from typing import Any


class InputError(ValueError):
    """A fault in something the user gave: a file, a folder, a setting, a name.

    The message is one line that names the thing, what is wrong with it and what to do.
    The command line prints it to stderr and exits with status 2.
    """

    def __init__(self, subject: object, fault: str, remedy: str = "") -> None:
        line = f"{subject}: {fault}" + (f"; {remedy}" if remedy else "")
        super().__init__(" ".join(line.split()))


def require_known(kind: str, name: object, known: Collection[str]) -> None:
    """Raise an InputError that lists the known names of a kind of thing unless this is one of them."""
    if name not in known:
        raise InputError(f"{kind} '{name}'", "unknown", f"choose one of {', '.join(known)}")


def with_key(key: str, function: Callable[..., Any], *arguments: object) -> Any:
    """Call the function and name the config's key in front of its InputError, or of what the system refuses."""
    try:
        return function(*arguments)
    except (InputError, OSError) as fault:
        raise InputError(f"config key {key}", str(fault)) from fault


def require_names(
    key: str, names: Iterable[str], known: Collection[str], noun: str, left_out: Collection[str] = ()
) -> None:
    """Raise an InputError for the first of the names at a key that is not known, or that the config leaves out."""
    for name in names:
        if name not in known:
            fault = f"{noun} '{name}' is left out" if name in left_out else f"no {noun} '{name}'"
            raise InputError(f"config key {key}", fault, f"choose one of {', '.join(known)}")


@contextmanager
def one_line() -> Iterator[None]:
    """End the process with one line where the user gave something faulty, or where a file cannot be used."""
    try:
        yield
    except (InputError, OSError) as fault:
        sys.exit(f"gpca: {fault}")
