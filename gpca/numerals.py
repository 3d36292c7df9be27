"""Numbers in text: those of users are finite plain decimals in ASCII, and lengths are shown without exponents."""

import math
import re

LEAST_SHOWN = 1e-9  # what is smaller is rounding
LARGEST_NUMBER = 1e15  # squares of larger numbers leave the range of float32
_WHOLE = re.compile("-?[0-9]{1,19}")
_DECIMAL = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]{1,4})?")


def whole(text: str, least: int = 0, most: int = 10**9) -> int:
    """Return a whole number from `least` to `most`; ValueError for any other text."""
    if not _WHOLE.fullmatch(text) or not least <= int(text) <= most:
        raise ValueError(f"'{text[:40]}' is not a whole number from {least} to {most}")
    return int(text)


def in_decimals(value: float, digits: int = 2) -> str:
    """Return a number with that many significant digits, without an exponent: 0.000013, 1200; 0 below `LEAST_SHOWN`."""
    if abs(value) < LEAST_SHOWN:
        return "0"
    decimals = digits - 1 - math.floor(math.log10(abs(value))) if value and math.isfinite(value) else 0
    text = f"{round(value, decimals):.{max(decimals, 0)}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def decimal(text: str) -> float:
    """Return a finite number, with or without decimals and exponent; ValueError for any other text."""
    if not _DECIMAL.fullmatch(text) or not math.isfinite(value := float(text)):
        raise ValueError(f"'{text[:40]}' is not a finite decimal number")
    return value
