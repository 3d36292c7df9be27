"""Numbers in users' text: plain decimals in ASCII, finite, and nothing else.

Python's int() and float() read more, each of which is a slip or damage in a file: digits of other scripts, underlines
between digits, NaN and infinity, and whole numbers so long that they take minutes.
"""

from __future__ import annotations

import math
import re

_WHOLE = re.compile("-?[0-9]{1,19}")
_DECIMAL = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]{1,4})?")


def whole(text: str, least: int = 0, most: int = 10**9) -> int:
    """Return a whole number from `least` to `most`; ValueError where the text is none."""
    if not _WHOLE.fullmatch(text) or not least <= int(text) <= most:
        raise ValueError(f"'{text[:40]}' is not a whole number from {least} to {most}")
    return int(text)


def decimal(text: str) -> float:
    """Return a finite number, with or without decimals and exponent; ValueError where the text is none."""
    if not _DECIMAL.fullmatch(text) or not math.isfinite(value := float(text)):
        raise ValueError(f"'{text[:40]}' is not a finite decimal number")
    return value
