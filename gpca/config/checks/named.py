"""Faults of a config by the key that they are at."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from typing import Any

from gpca.errors import InputError


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
