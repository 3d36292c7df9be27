"""Numbers in users' text: finite plain decimals in ASCII.

Python's int() and float() also accept digits of other scripts, underscores, NaN and infinity, and integers so long that
they take minutes; all of these are typos or damage in a file.
"""

from __future__ import annotations

import math
import re

LARGEST_NUMBER = 1e15  # squares of larger numbers leave the range of float32
_WHOLE = re.compile("-?[0-9]{1,19}")
_DECIMAL = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]{1,4})?")


def whole(text: str, least: int = 0, most: int = 10**9) -> int:
    """Return a whole number from `least` to `most`; ValueError for any other text."""
    if not _WHOLE.fullmatch(text) or not least <= int(text) <= most:
        raise ValueError(f"'{text[:40]}' is not a whole number from {least} to {most}")
    return int(text)


def decimal(text: str) -> float:
    """Return a finite number, with or without decimals and exponent; ValueError for any other text."""
    if not _DECIMAL.fullmatch(text) or not math.isfinite(value := float(text)):
        raise ValueError(f"'{text[:40]}' is not a finite decimal number")
    return value
