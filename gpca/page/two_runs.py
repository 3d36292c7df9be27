"""Compares two runs on a page: differences of code and config, of verdicts, tables and figures."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from os.path import commonpath, relpath
from pathlib import Path
from typing import NamedTuple

from gpca.errors import InputError, refusing
from gpca.io.files import require_file, sha256_of_file, write_text
from gpca.jobs.provenance import read_record
from gpca.page.comparison import page_comparison
from gpca.page.page import read_provenance, render

SAME, DIFFERENT, APART, ALONE = "same", "different", "apart", "alone"  # kinds of a cell of both runs
CONFIG = "Config (SHA-256)"  # of all sections, which are compared one by one instead
AGAIN = "make the run again"
LARGEST_BYTES = 10**7  # of a table, hundreds of times the largest
LEFT = ":--"  # alignment of columns of names in Markdown
_CELLS = re.compile(r"(?<!\\)\|")
_DIGITS = r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
_NUMBER = re.compile(rf"(?:> )?({_DIGITS})(?: ± ({_DIGITS})| \(({_DIGITS}) to ({_DIGITS})\))?")
Folders = tuple[Path, Path]  # results/{run} of two runs, or their references


class PrintedTable(NamedTuple):
    """A table as readers see it."""

    caption: str  # the line above it
    heads: Sequence[str]  # of the columns, those of names first
    labels: int  # number of columns of names
    rows: Sequence[Sequence[str]]  # of texts, one per head

    def by_names(self, labels: int) -> dict[tuple, dict[str, str]]:
        """Return (names of a row, number of earlier rows with these names) -> head -> text."""
        seen: Counter = Counter()
        rows = {}
        for row in self.rows:
            key = tuple(row[:labels])
            rows[*key, seen[key]] = dict(zip(self.heads[labels:], row[labels:], strict=True))
            seen[key] += 1
        return rows


class PrintedNumber(NamedTuple):
    """A number with the bounds of its interval."""

    value: float
    low: float  # NaN where none is printed
    high: float
    decimals: int


def read_printed_table(path: Path) -> PrintedTable:
    """Read the Markdown that :meth:`gpca.reporting.tables.table.Table.write` wrote; an InputError for another file."""
    require_file(path, "no such file", AGAIN, LARGEST_BYTES)
    with refusing(path, "is not readable ({})", AGAIN):
        text = path.read_text(encoding="utf-8")
    lines = []
    for line in text.splitlines():
        if line.startswith("| "):
            cells = [cell.strip().replace("\\|", "|") for cell in _CELLS.split(line)[1:-1]]
            lines.append([re.sub(r"\A\*\*(.+)\*\*\Z", r"\1", cell) for cell in cells])
    if len(lines) < 2 or any(len(line) != len(lines[0]) for line in lines):
        raise InputError(path, "holds no table, or one with rows of several lengths", AGAIN)
    heads, rule, *rows = lines
    caption = text.split("\n", 1)[0].strip("*")
    return PrintedTable(caption, heads, sum(cell == LEFT for cell in rule), rows)


def read_number(text: str) -> PrintedNumber | None:
    """Return the number at the start of a cell, ``97.7 ± 0.4``, ``97.7 (96.9 to 98.2)`` or ``> 52.0``, if any."""
    match = _NUMBER.match(text)
    if match is None:
        return None
    value = float(match[1])
    low, high = (float(end) if end else math.nan for end in (match[3], match[4]))
    if match[2]:
        low, high = value - float(match[2]), value + float(match[2])
    return PrintedNumber(value, low, high, len(match[1].partition(".")[2]))


class TwoTables(NamedTuple):
    """A table of both runs, cell by cell."""

    name: str
    title: str
    caption: str
    heads: Sequence[str]  # as in :class:`PrintedTable`; those of the second alone come last
    labels: int
    rows: Sequence[tuple[Sequence[str], Sequence[Mapping[str, str]]]]  # names of each row, and its cells
    kinds: Mapping[str, int]  # number of cells of each


def compare_tables(folders: Folders, titles: Mapping[str, str]) -> tuple[list[TwoTables], list[list[str]]]:
    """Return the tables that both folders have, and the names of those that only the first or only the second has."""
    files = [{path.stem: path for path in folder.glob("tables/*.md")} for folder in folders]
    for folder, paths in zip(folders, files, strict=True):
        if not paths:
            raise InputError(folder, "has no tables/*.md", "name the folder of a finished run, such as results/default")
    tables = []
    for name in _shared(files, titles):
        one, other = (read_printed_table(paths[name]) for paths in files)
        labels = min(one.labels, other.labels)
        heads = list(dict.fromkeys([*one.heads[labels:], *other.heads[labels:]]))
        first, second = one.by_names(labels), other.by_names(labels)
        rows = []
        for key in dict.fromkeys([*first, *second]):
            cells = [_cell(*(rows_of.get(key, {}).get(head, "") for rows_of in (first, second))) for head in heads]
            rows.append((key[:-1], cells))
        kinds = Counter(cell["kind"] for _, cells in rows for cell in cells)
        heads = [*one.heads[:labels], *heads]
        tables.append(TwoTables(name, titles.get(name, name), one.caption, heads, labels, rows, kinds))
    one_names, other_names = (paths.keys() for paths in files)
    return tables, [sorted(one_names - other_names), sorted(other_names - one_names)]


def _shared(files: Sequence[Mapping[str, Path]], titles: Mapping[str, str]) -> list[str]:
    """Return the names that both have, in the order of the titles."""
    both = files[0].keys() & files[1].keys()
    return [name for name in titles if name in both] + sorted(both - titles.keys())


def _cell(one: str, other: str) -> dict[str, str]:
    if one == other:
        return {"one": one, "other": "", "difference": "", "kind": SAME}
    first, second = read_number(one), read_number(other)
    if first is None or second is None:
        return {"one": one, "other": other, "difference": "", "kind": DIFFERENT if one and other else ALONE}
    difference = f"{second.value - first.value:+z.{max(first.decimals, second.decimals)}f}"
    kind = APART if first.high < second.low or second.high < first.low else DIFFERENT  # where both have intervals
    return {"one": one, "other": other, "difference": difference, "kind": kind}


def write_comparison(
    folders: Folders, tables: Sequence[TwoTables], alone: Sequence[Sequence[str]], titles: Mapping[str, str], path: Path
) -> None:
    """Write the page of two runs, which refers to their figures."""
    paths = [folder.resolve() for folder in folders]
    names = [each.name for each in paths]
    if names[0] == names[1]:
        names = [relpath(each, commonpath(paths)) for each in paths]
    figures = [{figure.stem: figure for figure in folder.glob("figures/*.png")} for folder in folders]
    facts, sections, numbers = zip(*map(_recorded, folders), strict=True)
    kinds = {kind: [", ".join(values.get(kind, ["–"])) for values in facts] for kind in {**facts[0], **facts[1]}}
    text = render(
        "compare.html.jinja",
        names=names,
        facts=[(kind, *values) for kind, values in kinds.items() if kind != CONFIG and values[0] != values[1]],
        sections=sorted(
            name for name in {**sections[0], **sections[1]} if len({each.get(name) for each in sections}) > 1
        ),
        verdicts=[
            {**one, "one": one, "other": other}
            for one, other in ((numbers[0][key], numbers[1][key]) for key in numbers[0] if key in numbers[1])
            if one["verdict"] != other["verdict"]
        ],
        tables=tables,
        alone=alone,
        figures=[
            {
                "name": name,
                "title": titles.get(name, name),
                "same": len({sha256_of_file(each[name]) for each in figures}) == 1,
                "paths": [relpath(each[name].resolve(), path.parent.resolve()) for each in figures],
            }
            for name in _shared(figures, titles)
        ],
    )
    write_text(path, text)


def _recorded(folder: Path) -> tuple[dict[str, dict[str, int]], dict[str, frozenset[str]], dict[tuple[str, ...], dict]]:
    """Return the recorded facts of a run, hashes of the config's sections, and numbers compared with the paper's."""
    files = sorted([*folder.glob("tables/*.csv"), *folder.glob("*.csv")])
    hashes: dict[str, frozenset[str]] = {}
    for path in files:
        for section, digest in (read_record(path).get("config_sha256") or {}).items():
            hashes[section] = hashes.get(section, frozenset()) | {digest}
    compared = page_comparison(folder / "comparison.csv")
    rows = [row for table in (compared["tables"] if compared else ()) for row in table["rows"]]
    return read_provenance(files), hashes, {(row["table"], row["row"], row["column"]): row for row in rows}
