"""Reads the Markdown that :mod:`gpca.reporting.tables.table` writes: the form of a table that readers see.

Nothing else that a run keeps will do: the CSV has neither titles, printed digits, bold cells nor footnotes.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from gpca.errors import InputError
from gpca.io.limits import require_file


@dataclass(frozen=True)
class ShownCell:
    """Holds a cell as it is printed; the best of those compared are bold."""

    text: str
    bold: bool


@dataclass(frozen=True)
class ShownTable:
    """Holds a table as it is printed.

    Attributes:
        caption: The line above it.
        heads: The heads of the columns.
        label_columns: The number of columns, from the left, that name the rows; the others hold numbers.
        rows: The rows of cells.
        footnotes: The paragraphs below it.
    """

    caption: str
    heads: tuple[str, ...]
    label_columns: int
    rows: tuple[tuple[ShownCell, ...], ...]
    footnotes: tuple[str, ...]


def read_markdown_table(path: str | Path) -> ShownTable:
    """Read a table's Markdown file.

    Raises:
        InputError: missing or unreadable file, no caption, no table, rows of different lengths.
    """
    remedy = "regenerate it with snakemake"
    require_file(path, "no such file", remedy)
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (UnicodeDecodeError, OSError) as fault:
        raise InputError(path, f"is not readable text ({fault})", remedy) from fault
    caption, *blocks = text.strip().split("\n\n")
    lines = blocks[0].splitlines() if blocks else []
    if not re.fullmatch(r"\*\*.+\*\*", caption) or len(lines) < 3 or not all(line.startswith("| ") for line in lines):
        raise InputError(path, "is not a caption with a table below it", remedy)
    heads, rule, *body = (_cells(line) for line in lines)
    if any(len(row) != len(heads) for row in (rule, *body)):
        raise InputError(path, "contains rows of different lengths", remedy)
    return ShownTable(
        caption=caption[2:-2],
        heads=tuple(cell.text for cell in heads),
        label_columns=sum(cell.text == ":--" for cell in rule),
        rows=tuple(body),
        footnotes=tuple(blocks[1:]),
    )


def _cells(line: str) -> tuple[ShownCell, ...]:
    texts = [text.strip().replace("\\|", "|") for text in re.split(r"(?<!\\)\|", line)[1:-1]]
    bold = [len(text) > 4 and text.startswith("**") and text.endswith("**") for text in texts]
    return tuple(ShownCell(text[2:-2] if b else text, b) for text, b in zip(texts, bold, strict=True))
