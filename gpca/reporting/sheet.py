"""Tables as rows × columns of selections of the measured numbers, and what else experiments make tables of."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

from gpca.io.frame import Frame
from gpca.reporting.tables.builder import FAMILIES, Label, TableBuilder, over_clusters
from gpca.reporting.tables.cells import cell_of_repeats, interval_cell, plain_cell, rows_where, where  # noqa: F401
from gpca.reporting.tables.table import EMPTY, Cell, Column, Table  # noqa: F401
from gpca.reporting.words import dataset_in_words, in_words, plural, span  # noqa: F401


@dataclass(frozen=True)
class Show(Column):
    """A column, and where its cells are found."""

    where: Mapping[str, str] = field(default_factory=dict)  # entries of the numbers' rows, besides those of the row
    factor: float = 100  # from the measure's unit to the column's
    frame: str = ""  # name of a frame of values by seed, which are averaged over the seeds; empty for that of intervals


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


def with_label(rows: Iterable[Row], label_of: Callable[[Row], str]) -> list[Row]:
    """Rows with one more label, which is its own title."""
    return [replace(row, labels=[*row.labels, (label_of(row),) * 2]) for row in rows]


def interval_of(rows: Frame, column: Show) -> Cell | None:
    """Cell of the one row that a column chooses, with its interval; by default, a row that is no difference."""
    chosen = where(rows, {"against": ""} | dict(column.where))
    return interval_cell(chosen.iloc[0], factor=column.factor) if len(chosen) else None


class Sheet(TableBuilder):
    """A table that is being made; an InputError says that it has no row.

    Args:
        name, heads: name of the table, titles of its labels by key.
        rows, columns: what it shows; rows and columns without any number are left out.
        intervals: numbers, with an interval each by default (:func:`gpca.evaluation.measures.read_clustered`).
        by_seed: name -> numbers by seed; the first frame counts the test samples.
        sources: those over which numbers by seed are averaged, in rows that name no source.
        blank: tells of row and column key whether the cell stays empty.
        more: function of a row and its numbers, if it has any, that returns further cells by column.
        cell: makes a cell of a row's numbers and a column.
    """

    def __init__(
        self,
        name: str,
        heads: Mapping[str, str],
        rows: Iterable[Row],
        columns: Mapping[str, Column],
        intervals: Frame,
        by_seed: Mapping[str, Frame] | None = None,
        sources: Sequence[str] = (),
        blank: Callable[[Row, str], bool] = lambda row, key: False,
        more: Callable[[Row, Frame], Mapping[str, Cell | None]] = lambda row, subset: {},
        cell: Callable[[Frame, Show], Cell | None] = interval_of,
    ) -> None:
        super().__init__(name, heads)
        self.columns = columns
        self.rows: list[Row] = []
        for row in rows:
            subset = where(intervals, row.where)
            cells: dict[str, Cell | None] = {}
            for key, column in columns.items():
                if not isinstance(column, Show) or blank(row, key):
                    continue
                if column.frame:
                    cells[key] = _over_sources(row, column, by_seed or {}, sources)
                else:
                    cells[key] = cell(subset, column)
            self.add_row(row.labels, cells | dict(more(row, subset) if len(subset) else {}), row.rival)
            if len(self.labels) > len(self.rows):
                self.rows.append(row)
        self.require_rows()

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
        self.compare_across(bold_across)
        self.compare_down(bold, same)
        filled = {key for _, key in self.cells}
        columns = {key: column for key, column in self.columns.items() if keep_empty or key in filled}
        return self.build(caption, across, columns, notes)


def _over_sources(row: Row, column: Show, by_seed: Mapping[str, Frame], sources: Sequence[str]) -> Cell | None:
    """Return the mean over the seeds of what all pairs of a seed have, whatever their source."""
    shared = {"method": row.where["method"], "concept": column.where["concept"]}
    counts = where(next(iter(by_seed.values())), shared | {"metric": "test_samples"})
    values = where(by_seed[column.frame], shared | {"metric": column.where["metric"]})
    both = values.merge(counts, on=["source", "seed"], suffixes=("", "_n"))
    both = both[both["source"].isin([row.where["source"]] if "source" in row.where else list(sources))]
    sums = (both["value"] * both["value_n"]).groupby(both["seed"]).sum()
    counts_R = both.groupby("seed")["value_n"].sum()
    return cell_of_repeats((column.factor * sums / counts_R).to_numpy(), int(counts_R.sum()))
