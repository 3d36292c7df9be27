"""Reads a printed table of a run back from its Markdown, which every run and every reference keeps."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from gpca.errors import InputError

LEFT = ":--"  # how columns of names are aligned; those of numbers are not
_CELLS = re.compile(r"(?<!\\)\|")
_DIGITS = r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
_NUMBER = re.compile(rf"(?:> )?({_DIGITS})(?: ± ({_DIGITS})| \(({_DIGITS}) to ({_DIGITS})\))?")


@dataclass(frozen=True)
class PrintedTable:
    """A table as readers see it.

    Attributes:
        caption: the line above it.
        heads: of the columns, those of names first.
        labels: how many of these are columns of names.
        rows: of texts, a text per head.
    """

    caption: str
    heads: Sequence[str]
    labels: int
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True)
class PrintedNumber:
    """A number with the ends of its interval, which are None where none is printed."""

    value: float
    low: float | None
    high: float | None
    decimals: int

    def is_apart(self, other: PrintedNumber) -> bool:
        """Return whether both have an interval, and these have nothing in common."""
        if self.low is None or self.high is None or other.low is None or other.high is None:
            return False
        return self.high < other.low or other.high < self.low


def read_printed_table(path: Path) -> PrintedTable:
    """Read the Markdown that :meth:`gpca.reporting.tables.table.Table.write` wrote.

    Raises:
        InputError: missing or unreadable file, or no such table in it.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as fault:
        raise InputError(path, f"is not readable ({fault})", "make the run again") from fault
    lines = [_cells(line) for line in text.splitlines() if line.startswith("| ")]
    if len(lines) < 2 or any(len(line) != len(lines[0]) for line in lines):
        raise InputError(path, "holds no table, or one with rows of several lengths", "make the run again")
    heads, rule, *rows = lines
    caption = text.split("\n", 1)[0].strip("*")
    return PrintedTable(caption, heads, sum(cell == LEFT for cell in rule), rows)


def read_number(text: str) -> PrintedNumber | None:
    """Return the number that a cell begins with, ``97.7 ± 0.4`` or ``97.7 (96.9 to 98.2)``; None where there is none.

    A bound, as in ``> 52.0``, counts as its value.
    """
    found = _NUMBER.match(text)
    if found is None:
        return None
    value = float(found[1])
    low, high = (float(end) if end else None for end in (found[3], found[4]))
    if found[2]:
        low, high = value - float(found[2]), value + float(found[2])
    return PrintedNumber(value, low, high, len(found[1].partition(".")[2]))


def _cells(line: str) -> list[str]:
    cells = [cell.strip().replace("\\|", "|") for cell in _CELLS.split(line)[1:-1]]
    return [cell[2:-2] if len(cell) > 4 and cell.startswith("**") and cell.endswith("**") else cell for cell in cells]
