"""The known reasons why printed numbers were not reached: ``reasons.csv`` (docs/comparison.md)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from gpca.comparison.published import PUBLISHED, Number, read_lines

REASONS = PUBLISHED.with_name("reasons.csv")
NONE_YET = "no reason found yet"


@dataclass(frozen=True)
class Reason:
    """A reason and the numbers that it applies to; `*` in row and column stands for any text."""

    table: str
    row: str
    column: str
    text: str

    def fits(self, number: Number) -> bool:
        """Return whether it applies to this number."""
        patterns = (self.table, self.row, self.column)
        return all(fnmatchcase(name, pattern) for name, pattern in zip(number.key, patterns, strict=True))


def read_reasons() -> list[Reason]:
    """Return the reasons, in the order of the file."""
    return [Reason(*fields.values()) for fields in read_lines(REASONS)]


def reason_of(number: Number, reasons: Sequence[Reason]) -> str:
    """Return the first reason that applies to the number."""
    return next((reason.text for reason in reasons if reason.fits(number)), NONE_YET)
