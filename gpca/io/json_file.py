"""JSON files of others, read strictly: faults that the standard library accepts silently are refused in one line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from gpca.errors import InputError
from gpca.io.limits import require_file

LARGEST_BYTES = 2**26  # ten times the largest scene of the BOP benchmark; parsed, it takes ten times the memory


def read_json(path: Path, what: str, remedy: str) -> dict[str, Any]:
    """Return the object that a JSON file holds.

    Args:
        what: the kind of file, for the message: "is not `what`".

    Raises:
        InputError: missing, too large, not UTF-8, another type than an object, or what :func:`parse_json` refuses.
    """
    require_file(path, "no such file", remedy, LARGEST_BYTES)
    try:
        content = parse_json(path.read_text(encoding="utf-8"))
    except ValueError as fault:  # also of UTF-8
        raise InputError(path, f"is not {what} ({fault})", remedy) from fault
    if not isinstance(content, dict):
        raise InputError(path, f"is not {what} (its top level is not an object)", remedy)
    return content


def parse_json(text: str) -> Any:
    """Return the value of a JSON text.

    Raises:
        ValueError: no JSON (a JSONDecodeError), nested too deeply, a key that stands twice in an object, of which
            Python would keep the last, or NaN or infinity, which JSON does not have.
    """
    try:
        return json.loads(text, object_pairs_hook=_without_duplicates, parse_constant=_no_constant)
    except RecursionError as fault:
        raise ValueError("nested too deeply") from fault


def finite_numbers(value: Any, count: int, subject: object, name: str, remedy: str) -> np.ndarray:
    """Return the numbers of a list, or of a list of rows; one number may stand by itself.

    Raises:
        InputError: another count, something else than a number, or one that is not finite; it says that `name` has it.
    """
    rows = value if isinstance(value, list) and count > 1 else [value]
    numbers = [number for row in rows for number in (row if isinstance(row, list) and count > 1 else [row])]
    for number in numbers:
        if type(number) not in (int, float):
            raise InputError(subject, f"{name} contains {repr(number)[:40]}, which is not a number", remedy)
        if not abs(number) < 1e300:  # also NaN, and an integer that no float holds
            raise InputError(subject, f"{name} contains a number that is not finite", remedy)
    if len(numbers) != count:
        raise InputError(subject, f"{name} has {len(numbers)} numbers, not {count}", remedy)
    return np.array(numbers, float)


def _without_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise ValueError(f"key {key[:40]!r} appears twice")
        found[key] = value
    return found


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a number")
