"""Names of sources, objects, concepts and splits; and the source and the seed that a file belongs to.

The step that makes a file writes source and seed into it, and those that read it check them: files of another source or
seed often have the same shapes, so nothing else would tell that they do not belong.
"""

from __future__ import annotations

from pathlib import Path
from unicodedata import category

from gpca.errors import InputError

SPLITS = ("train", "test")
Axes = tuple[str, int | None]  # source and seed; the objects of a source have no seed
_BREAKS = ("Cc", "Zl", "Zp")  # control characters, and separators of lines and paragraphs


def is_name(text: str) -> bool:
    """Return whether a text can name something: it is not blank, and a line or less."""
    return bool(text.strip()) and not any(category(character) in _BREAKS for character in text)


def _in_words(axes: Axes) -> str:
    """Return source and seed as a message names them."""
    source, seed = axes
    return f"source '{source}'" + ("" if seed is None else f", seed {seed}")


def require_axes(path: str | Path, actual: Axes, expected: Axes | None) -> None:
    """Raise an InputError unless a file is of the source and seed that are expected; of any where that is None."""
    if expected is not None and actual != expected:
        wanted = _in_words(expected)
        raise InputError(path, f"is of {_in_words(actual)}, not of {wanted}", f"give the file of {wanted}")
