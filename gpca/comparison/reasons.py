"""Why a printed number was not reached, as far as it was found out: ``reasons.csv`` (docs/comparison.md)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from gpca.comparison.published import PUBLISHED, Number, read_lines
from gpca.errors import InputError

REASONS = PUBLISHED.with_name("reasons.csv")
REASON_COLUMNS = ("table", "row", "column", "reason")
NONE_YET = "no reason found yet"


@dataclass(frozen=True)
class Reason:
    """A reason and the numbers that it is of; `*` in row and column stands for any text."""

    table: str
    row: str
    column: str
    text: str

    def fits(self, number: Number) -> bool:
        """Return whether it is of this number."""
        patterns = (self.table, self.row, self.column)
        return all(fnmatchcase(name, pattern) for name, pattern in zip(number.key, patterns, strict=True))


def read_reasons(numbers: Iterable[Number], path: str | Path = REASONS) -> list[Reason]:
    """Read the reasons.

    Raises:
        InputError: missing or unreadable file, other columns, a reason of no number, an empty one. It names the line.
    """
    numbers = list(numbers)
    reasons = []
    for line, fields in read_lines(path, REASON_COLUMNS):
        where = f"{path}, line {line}"
        reason = Reason(*fields.values())
        if not reason.text:
            raise InputError(where, "'reason' is empty", "say what was found, or remove the line")
        if not any(reason.fits(number) for number in numbers):
            named = " / ".join((reason.table, reason.row, reason.column))
            raise InputError(where, f"{named} is not a printed number", "use names from published.csv, or *")
        reasons.append(reason)
    return reasons


def reason_of(number: Number, reasons: Sequence[Reason]) -> str:
    """Return the first reason that is of the number."""
    return next((reason.text for reason in reasons if reason.fits(number)), NONE_YET)
