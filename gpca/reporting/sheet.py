"""Tables as rows × columns of selections: each says which rows of the measured numbers its cells show."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import TYPE_CHECKING, Any

from gpca.errors import InputError
from gpca.reporting.tables.builder import FAMILIES, NEAR_LIMITS, over_clusters
from gpca.reporting.tables.cells import cell_over_sources, interval_cell, share_within_limits
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import span

if TYPE_CHECKING:
    import pandas as pd

Label = tuple[str, str]  # key for the CSV, title for the reader


@dataclass(frozen=True)
class Show(Column):
    """A column, and where its cells are found.

    Attributes:
        where: entries of the numbers' rows, besides those of the table's row.
        factor: from the measure's unit to the column's.
        frame: name of a frame of values by seed, which are averaged over the seeds; empty for that of intervals.
    """

    where: Mapping[str, str] = field(default_factory=dict)
    factor: float = 100
    frame: str = ""


def show(metric: str, title: str, part: str = "all", where: Mapping[str, str] | None = None, **options: Any) -> Show:
    """Column of a metric of one part of the samples; ``where={"against": …}`` for a difference."""
    return Show(title, where={"metric": metric, "concept": part} | dict(where or {}), **options)


@dataclass(frozen=True)
class Row:
    """A row: its labels, the entries of the numbers that it shows, and whether it competes for bold."""

    labels: Sequence[Label]
    where: Mapping[str, str]
    rival: bool = True


def crossed(*axes: tuple[str, Mapping[str, str]]) -> list[Row]:
    """Rows of every combination of names; an axis is a column of the numbers, and its titles by name."""
    columns = [column for column, _ in axes]
    return [
        Row(labels, dict(zip(columns, (key for key, _ in labels), strict=True)))
        for labels in product(*(titles.items() for _, titles in axes))
    ]


class Sheet:
    """A table that is being made.

    Args:
        name, heads: name of the table, titles of its labels by key.
        rows, columns: what it shows; rows and columns without any number are left out.
        intervals: numbers with an interval each (:func:`gpca.evaluation.measures.read_clustered`).
        by_seed: name -> numbers by seed; the first frame counts the test samples.
        sources: those over which numbers by seed are averaged, in rows that name no source.
        blank: tells of row and column key whether the cell stays empty.
        more: function of a row and its numbers, if it has any, that returns further cells by column.
    """

    def __init__(
        self,
        name: str,
        heads: Mapping[str, str],
        rows: Iterable[Row],
        columns: Mapping[str, Column],
        intervals: pd.DataFrame,
        by_seed: Mapping[str, pd.DataFrame] | None = None,
        sources: Sequence[str] = (),
        blank: Callable[[Row, str], bool] = lambda row, key: False,
        more: Callable[[Row, pd.DataFrame], Mapping[str, Cell]] = lambda row, subset: {},
    ) -> None:
        self.name, self.heads, self.columns = name, heads, columns
        self._by_seed, self._sources = dict(by_seed or {}), sources
        self.rows: list[Row] = []
        self.cells: dict[tuple[int, str], Cell] = {}
        for row in rows:
            subset = where(intervals, row.where)
            shows = {key: column for key, column in columns.items() if isinstance(column, Show) and not blank(row, key)}
            cells = {key: self._cell(subset, row, column) for key, column in shows.items()}
            cells |= more(row, subset) if len(subset) else {}
            if shown := {key: cell for key, cell in cells.items() if cell is not None}:
                self.cells |= {(len(self.rows), key): cell for key, cell in shown.items()}
                self.rows.append(row)
        if not self.rows:
            fault = "has nothing to show: its files hold no numbers of what the config names"
            raise InputError(f"table '{name}'", fault, "run that first")

    @property
    def seeds(self) -> int:
        """Number of seeds of the cell that has the most."""
        return max(cell.seeds for cell in self.cells.values())

    def samples(self, *keys: str, row: int = 0) -> str:
        """Numbers of test samples of some columns' cells in a row, such as ``15 to 200``."""
        return span(self.cells[row, key].test_samples for key in keys if (row, key) in self.cells)

    def over(self, samples: int | str = "", clusters: str = FAMILIES) -> str:
        """Start of the footnote on the cells' intervals, without a full stop; `clusters` in the plural."""
        return over_clusters(self.seeds, samples, clusters)

    def table(
        self,
        caption: str,
        across: str,
        notes: Iterable[str],
        bold: Iterable[str] = (),
        same: int = 0,
        bold_across: Iterable[str] = (),
        keep_empty: bool = False,
    ) -> Table:
        """The table; in each of the `bold` columns, rivals whose first `same` labels agree compete.

        Within each row, the columns of `bold_across` compete. With `keep_empty`, columns without any number stay.
        """
        groups: dict[tuple, list[tuple[int, str]]] = {}
        for key in bold_across:
            for number in range(len(self.rows)):
                groups.setdefault((number,), []).append((number, key))
        for key in bold:
            for number, row in enumerate(self.rows):
                if row.rival:
                    groups.setdefault((*row.labels[:same], key), []).append((number, key))
        filled = {key for _, key in self.cells}
        columns = {key: column for key, column in self.columns.items() if keep_empty or key in filled}
        cells = {key: share_within_limits(cell, columns[key[1]]) for key, cell in self.cells.items()}
        widened = any(cell is not self.cells[key] and columns[key[1]].interval for key, cell in cells.items())
        return Table(
            name=self.name,
            caption=caption,
            row_heads=self.heads,
            rows=tuple(tuple(row.labels) for row in self.rows),
            column_head=across,
            columns=columns,
            cells=cells,
            footnotes=(*notes, *((NEAR_LIMITS,) if widened else ())),
            compared=tuple(groups.values()),
        )

    def _cell(self, subset: pd.DataFrame, row: Row, column: Show) -> Cell | None:
        if column.frame:
            counts = next(iter(self._by_seed.values()))
            values, selected = self._by_seed[column.frame], (row.where["method"], column.where["metric"])
            sources = [row.where["source"]] if "source" in row.where else self._sources
            return cell_over_sources(counts, values, sources, *selected, column.where["concept"], column.factor)
        rows = where(subset, {"against": ""} | dict(column.where))
        return interval_cell(rows.iloc[0], factor=column.factor) if len(rows) else None


def where(frame: pd.DataFrame, entries: Mapping[str, str]) -> pd.DataFrame:
    """Rows of a frame with these entries; a column that it lacks is empty."""
    for column, value in entries.items():
        if column in frame:
            frame = frame[frame[column] == value]
        elif value:
            return frame[:0]
    return frame
