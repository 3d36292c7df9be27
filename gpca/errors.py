"""The exception for a user's mistake, which is shown as one line instead of a traceback."""

import sys
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from typing import Any


class InputError(ValueError):
    """A fault in the user's file, folder, setting or name: one line with subject, fault and remedy."""

    further: tuple[str, ...] = ()  # lines of other faults of the same settings

    def __init__(self, subject: object, fault: str, remedy: str = "") -> None:
        line = f"{subject}: {fault}" + (f"; {remedy}" if remedy else "")
        super().__init__(" ".join(line.split()))


def require_known(kind: str, name: object, names: Collection[str]) -> None:
    """Raise an InputError that lists the possible names unless `name` is one of them."""
    if name not in names:
        raise InputError(f"{kind} '{name}'", "unknown", f"choose one of {', '.join(names)}")


def with_key(key: str, function: Callable[..., Any], *arguments: object) -> Any:
    """Call the function, and prefix its InputError or OSError with the config's key."""
    try:
        return function(*arguments)
    except (InputError, OSError) as fault:
        raise InputError(f"config key {key}", str(fault)) from fault


def require_names(
    key: str, names: Iterable[str], allowed: Collection[str], noun: str, left_out: Collection[str] = ()
) -> None:
    """Raise an InputError for the first name at a key that is unknown, or that the config leaves out."""
    for name in names:
        if name not in allowed:
            fault = f"{noun} '{name}' is left out" if name in left_out else f"no {noun} '{name}'"
            raise InputError(f"config key {key}", fault, f"choose one of {', '.join(allowed)}")


@contextmanager
def refusing(subject: object, fault: str, remedy: str) -> Iterator[None]:
    """Raise an InputError for any other error, whose message takes the place of ``{}`` in the fault."""
    try:
        yield
    except (InputError, ModuleNotFoundError):
        raise
    except Exception as error:
        raise InputError(subject, fault.replace("{}", str(error)), remedy) from error


@contextmanager
def one_line() -> Iterator[None]:
    """End the process with one line for an InputError or OSError."""
    try:
        yield
    except (InputError, OSError) as fault:
        sys.exit(f"gpca: {fault}")
