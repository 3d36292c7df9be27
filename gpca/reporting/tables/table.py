"""Writes a table as CSV for machines, Markdown for readers (:func:`short`) and JSON for the page."""

import csv
import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

from gpca.evaluation.intervals import TRIVIAL
from gpca.evaluation.measures import POOLED
from gpca.io.files import whole_file, write_text
from gpca.process.plugins import names_outside

EMPTY = "–"  # where there is no number
LEAST_SEEDS = 3  # A mean over fewer has no interval: that of two spans everything, however near they lie.
SHARE = (0.0, 100.0)  # limits of a share in percent
MOST_COLUMNS, MOST_ROWS = 6, 15  # of a table for readers
SIGHT, PAPERS = "reads", "gpca"  # label of what an explainer sees, for which there is no space; a row that always stays


@dataclass(frozen=True)
class Cell:
    """A mean over `seeds` repeats with the half-width of its 95 % t-interval, and the test samples of all."""

    mean: float
    half_width: float  # NaN where there is no interval, as over fewer than `LEAST_SEEDS`
    seeds: int
    test_samples: int
    at_least: bool = False  # a lower bound without interval, as some repeats were stopped before they were done
    bounds: tuple[float, float] | None = None  # of another interval (a bootstrap's, Wilson's), printed instead
    clusters: int = 0  # combinations of a seed and a cluster that the samples are of; 0 where their number is not known


@dataclass(frozen=True)
class Column:
    """How one quantity is shown: its title, the digits after the point, with an interval or without."""

    title: str
    decimals: int = 1
    interval: bool = True
    limits: tuple[float, float] = SHARE  # least and largest possible value; the bounds in the CSV are clipped to them
    least_is_best: bool = False
    beside: str = ""  # another column, behind whose cells these stand with their sign in brackets; the CSV holds both
    heavy_tail: bool = False  # an interval wider than the mean is not printed, as it would reach below zero

    def text(self, cell: Cell) -> str:
        """Return e.g. ``97.7 ± 0.4``, ``97.7 (96.9 to 98.2)`` or ``> 52.0``; beside another ``+1.2; 0.4 to 1.9``."""
        mean = f"{cell.mean:{'+' if self.beside else ''}z.{self.decimals}f}"
        if cell.at_least:
            return f"> {mean}"
        if not self.interval or math.isnan(cell.half_width) or (self.heavy_tail and cell.half_width > cell.mean):
            return mean
        if cell.bounds:
            bounds = " to ".join(f"{bound:z.{self.decimals}f}" for bound in cell.bounds)
            return f"{mean}; {bounds}" if self.beside else f"{mean} ({bounds})"
        return f"{mean} ± {cell.half_width:.{self.decimals}f}"


@dataclass(frozen=True)
class Table:
    """Rows by columns of cells; every name has a key for the CSV and a title for the reader."""

    name: str
    caption: str
    row_heads: Mapping[str, str]  # title of each row label by key, e.g. ``{"source": "Dataset"}``
    rows: tuple[tuple[tuple[str, str], ...], ...]  # labels of each row, a key and a title for each row head
    column_head: str  # key of what the columns are, e.g. ``explainer``
    columns: Mapping[str, Column]
    cells: Mapping[tuple[int, str], Cell]  # by row number and column key; a missing one is shown as a dash
    footnotes: tuple[str, ...] = ()
    compared: tuple[Sequence[tuple[int, str]], ...] = ()  # groups of cells; the best mean in each is bold

    def best(self) -> set[tuple[int, str]]:
        """Return the keys of the cells with the best printed mean of their group, which takes seeds for an interval.

        None are of a group of one, nor where all share the best, or more than half of a large group.
        """
        best: set[tuple[int, str]] = set()
        for group in self.compared:
            cells = {key: self.cells[key] for key in group if key in self.cells}
            printed = {
                key: round(cell.mean, self.columns[key[1]].decimals)
                for key, cell in cells.items()
                if not cell.at_least and (cell.seeds >= LEAST_SEEDS or cell.bounds)
            }
            if printed and len(cells) > 1:
                choose = min if self.columns[next(iter(printed))[1]].least_is_best else max
                chosen = {key for key, mean in printed.items() if mean == choose(printed.values())}
                tells_apart = len(chosen) < len(cells) and (len(chosen) <= 5 or 2 * len(chosen) <= len(cells))
                best |= chosen if tells_apart else set()
        return best

    def write(self, stem: str | Path) -> None:
        """Write ``{stem}.csv``, ``.md`` (:func:`short`), ``.json`` (both, for the page), each whole or not at all."""
        part = short(self)
        words = left_out(self, part)
        both = self.printed() | ({"short": part.printed() | {"left_out": words}} if words else {})
        page = json.dumps(both, indent=1, ensure_ascii=False) + "\n"
        for suffix, text in (("md", part.markdown(words)), ("json", page)):
            write_text(f"{stem}.{suffix}", text)
        with whole_file(f"{stem}.csv") as partial, partial.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows(self.records())

    def printed(self) -> dict[str, Any]:
        """Return the words that a reader sees; each cell is its text, and whether it is bold."""
        main = {name: column for name, column in self.columns.items() if not column.beside}
        best, rows = self.best(), []
        for row, labels in enumerate(self.rows):
            shown = [(title, False) for _, title in labels]
            for name, column in main.items():
                texts = []
                if (row, name) in self.cells:
                    beside = [(key, each) for key, each in self.columns.items() if each.beside == name]
                    texts = [f"({each.text(self.cells[row, key])})" for key, each in beside if (row, key) in self.cells]
                    texts.insert(0, column.text(self.cells[row, name]))
                shown.append((" ".join(texts) or EMPTY, (row, name) in best))
            rows.append(shown)
        return {
            "caption": self.numbered_caption,
            "heads": [*self.row_heads.values(), *(column.title for column in main.values())],
            "label_columns": len(self.row_heads),
            "rows": rows,
            "footnotes": list(self.footnotes),
        }

    def records(self) -> list[tuple]:
        """Return the CSV's rows, head first: one row per cell, in its column's unit, `n_test` over all seeds."""
        heads = (*self.row_heads, self.column_head, "mean", "ci_low", "ci_high", "n_seeds", "n_test", "at_least")
        records: list[tuple] = [heads]
        for (row, labels), (name, column) in product(enumerate(self.rows), self.columns.items()):
            if (cell := self.cells.get((row, name))) is None:
                continue
            least, most = column.limits
            low, high = (
                "" if cell.at_least or math.isnan(cell.half_width) else round(min(max(bound, least), most), 6)
                for bound in cell.bounds or (cell.mean - cell.half_width, cell.mean + cell.half_width)
            )
            counts = (cell.seeds, cell.test_samples, cell.at_least)
            records.append((*(key for key, _ in labels), name, round(cell.mean, 6), low, high, *counts))
        return records

    @property
    def numbered_caption(self) -> str:
        """The caption behind the table's number, if it has one: ``Table IX: …``."""
        numbered = re.match(r"table(\d+)_", self.name)
        return f"Table {_roman(int(numbered[1]))}: {self.caption}" if numbered else self.caption

    def markdown(self, note: str = "") -> str:
        """Return a GitHub table, caption above, footnotes below, first `note`."""
        printed = self.printed()
        rule = [":--" if number < len(self.row_heads) else "--:" for number in range(len(printed["heads"]))]
        body = [
            [f"**{text}**" if bold else text for text, bold in ((text.replace("|", "\\|"), bold) for text, bold in row)]
            for row in printed["rows"]
        ]
        table = "\n".join(f"| {' | '.join(row)} |" for row in (printed["heads"], rule, *body))
        return "\n\n".join(filter(None, [f"**{self.numbered_caption}**", table, note, *self.footnotes])) + "\n"


def short(table: Table) -> Table:
    """Return the table itself where it is small, or mostly text; else at most so many columns and rows of it.

    Rows over all sources are kept alone, if there are any. Those that compete in the first compared column are sorted
    by it, and the others follow: untrained rows, oracles.
    """
    if len(table.row_heads) >= len(_main(table)) or (
        len(table.rows) <= MOST_ROWS and len(table.row_heads) + len(_main(table)) <= MOST_COLUMNS
    ):
        return table
    score = next((key for group in table.compared for _, key in group if len({row for row, _ in group}) > 1), "")
    rows = [row for row, labels in enumerate(table.rows) if POOLED in dict(labels)] or list(range(len(table.rows)))
    rows = list(_best_rows(table, rows, score))
    heads = list(table.row_heads)
    shown = [place for place in range(len(heads)) if len({table.rows[row][place] for row in rows}) > 1]
    shown = [place for place in shown if heads[place] != SIGHT] or [len(heads) - 1]
    filled = {key for row, key in table.cells if row in rows}
    main = sorted(_main(table), key=lambda key: (key not in filled, key != score))[: MOST_COLUMNS - len(shown)]
    columns = {key: column for key, column in table.columns.items() if key in main or column.beside in main}
    order, best = {row: place for place, row in enumerate(rows)}, table.best()
    hidden = {(row, key) for row, key in best if row not in order or key not in columns}
    groups = [group for group in table.compared if not hidden.intersection(group)]  # else the second best were bold
    cells = {(order[row], key): cell for (row, key), cell in table.cells.items() if row in order and key in columns}
    return replace(
        table,
        row_heads={heads[place]: table.row_heads[heads[place]] for place in shown},
        rows=tuple(tuple(table.rows[row][place] for place in shown) for row in rows),
        columns={key: columns[key] for key in (*main, *(key for key in columns if key not in main))},
        cells=cells,
        compared=tuple([(order[row], key) for row, key in group if row in order] for group in groups),
    )


def left_out(whole: Table, part: Table) -> str:
    """Return what the part lacks, in words for readers; empty if nothing."""
    if part is whole:
        return ""
    counts = (len(part.rows), len(whole.rows), len(_main(part)), len(_main(whole)))
    return "{} of {} rows and {} of {} columns of numbers; {}.csv has all.".format(*counts, whole.name)


def _main(table: Table) -> list[str]:
    return [key for key, column in table.columns.items() if not column.beside]


def _best_rows(table: Table, rows: Sequence[int], score: str) -> Iterator[int]:
    """Yield at most `MOST_ROWS` rows: of each group that competes in a column the paper's, a user's and the best; then
    others.

    Where several groups compete, such as datasets, the best of the others follows each.
    """

    def names(row: int) -> set[str]:
        return {key for key, _ in table.rows[row]}

    def worth(row: int) -> float:
        cell = table.cells.get((row, score))
        return -math.inf if cell is None else cell.mean * (-1 if table.columns[score].least_is_best else 1)

    groups = [[row for row, key in group if key == score and row in rows] for group in table.compared]
    groups = [rivals for group in groups if (rivals := [row for row in group if not names(row) & set(TRIVIAL)])]
    others = [row for row in rows if not any(row in group for group in groups)]
    if not groups:
        yield from others[:MOST_ROWS]
        return
    others.sort(key=lambda row: bool(names(row) & set(TRIVIAL)))
    beside = others[: MOST_ROWS // 3] if len(groups) == 1 else []
    each = max(1, (MOST_ROWS - len(beside)) // len(groups) - (len(groups) > 1 and bool(others)))
    stays = {PAPERS, *names_outside()}
    for group in groups[:MOST_ROWS]:
        best = sorted(group, key=lambda row: (not names(row) & stays, -worth(row)))[:each]
        yield from sorted(best, key=worth, reverse=True)
        if len(groups) > 1:
            yield from sorted([row for row in others if table.rows[row][0] == table.rows[group[0]][0]], key=worth)[-1:]
    yield from beside


def _roman(number: int) -> str:
    """Return a number below 40 as the paper writes those of its tables."""
    tens, ones = divmod(number, 10)
    return "X" * tens + ("", "I", "II", "III", "IV", "V", "VI", "VII", "VIII", "IX")[ones]
