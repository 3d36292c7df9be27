"""What a file is of: a source and a seed, written into it by the step that makes it and checked by those that read it.

Files of another source or seed often have the same shapes, so nothing else would tell that they do not belong.
"""

from __future__ import annotations

from pathlib import Path

from gpca.errors import InputError

Axes = tuple[str, int | None]  # source and seed; the objects of a source have no seed


def in_words(axes: Axes) -> str:
    """Return source and seed as a message names them."""
    source, seed = axes
    return f"source '{source}'" + ("" if seed is None else f", seed {seed}")


def require_axes(path: str | Path, found: Axes, expected: Axes | None, made_by: str) -> None:
    """Raise an InputError unless a file is of the source and seed that are expected; of any where that is None."""
    if expected is not None and found != expected:
        remedy = f"give the file of {in_words(expected)}, or make it with '{made_by}'"
        raise InputError(path, f"is of {in_words(found)}, not of {in_words(expected)}", remedy)
