"""JSON files of others, read strictly: what the standard library lets pass in silence is refused in one line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NoReturn

from gpca.errors import InputError

LARGEST_BYTES = 2**26  # ten times the largest scene of the BOP benchmark; parsed, it takes ten times the memory


def read_json(path: Path, what: str, remedy: str) -> dict[str, Any]:
    """Return the object that a JSON file holds.

    Args:
        what: the kind of file, for the message: "is not `what`".

    Raises:
        InputError: missing, too large, not UTF-8, no JSON, nested too deep, another type than an object; a key that
            occurs twice in an object, of which Python keeps the last; NaN and infinity, which JSON does not have.
    """
    if not path.is_file():
        raise InputError(path, "no such file", remedy)
    if (size := path.stat().st_size) > LARGEST_BYTES:
        raise InputError(path, f"is {size / 2**20:.0f} MB, too large for {what}", remedy)
    try:
        content = json.loads(
            path.read_text(encoding="utf-8"), object_pairs_hook=_without_duplicates, parse_constant=_no_constant
        )
    except RecursionError as fault:
        raise InputError(path, f"is not {what} (nested too deep)", remedy) from fault
    except ValueError as fault:  # also of UTF-8, and of an integer of too many digits
        raise InputError(path, f"is not {what} ({fault})", remedy) from fault
    if not isinstance(content, dict):
        raise InputError(path, f"is not {what} (it holds no object at the top)", remedy)
    return content


def _without_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
        raise ValueError(f"key {twice[:40]!r} occurs twice")
    return found


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number")
