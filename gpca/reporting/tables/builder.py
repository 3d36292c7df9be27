"""Builds a table row by row: it knows which rows have cells, which compete for bold, and what all tables say below."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from math import nan
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.metrics import mean_interval
from gpca.errors import InputError
from gpca.objects.title import stand_in_clause
from gpca.reporting.tables.table import LEAST_SEEDS, Cell, Column, Table
from gpca.reporting.words import plural, span

if TYPE_CHECKING:
    import pandas as pd

INTERVAL = "± is the half-width of the 95 % t-interval over the seeds"
Label = tuple[str, str]  # key for the CSV, title for the reader


class TableBuilder:
    """Collects labelled rows of cells and makes a :class:`Table` of them.

    Attributes:
        name: The name of the table, which the error for an empty one mentions.
        row_heads: The title of each row label, by key.
        rows: The labels of the rows so far.
        cells: The cells so far, by row number and column key.
    """

    def __init__(self, name: str, row_heads: Mapping[str, str]) -> None:
        self.name = name
        self.row_heads = row_heads
        self.rows: list[tuple[Label, ...]] = []
        self.cells: dict[tuple[int, str], Cell] = {}
        self._rivals: set[int] = set()
        self._compared: list[list[tuple[int, str]]] = []

    def add_row(self, labels: Sequence[Label], cells: Mapping[str, Cell | None], rival: bool = True) -> None:
        """Add a row, unless it has no cell at all.

        Args:
            labels: The key and the title of one label per row head.
            cells: The cell of each column key, or None where there is no number.
            rival: Whether the row competes with others for bold, as an oracle does not.
        """
        found = {key: cell for key, cell in cells.items() if cell is not None}
        if not found:
            return
        row = len(self.rows)
        self.rows.append(tuple(labels))
        self.cells |= {(row, key): cell for key, cell in found.items()}
        if rival:
            self._rivals.add(row)

    def compare_across(self, columns: Iterable[str]) -> None:
        """Let these columns compete for bold within each row."""
        columns = list(columns)
        self._compared += [[(row, key) for key in columns] for row in range(len(self.rows))]

    def compare_down(self, columns: Iterable[str], same: int = 0) -> None:
        """Let the rivals whose first `same` labels agree compete for bold within each of these columns."""
        groups: dict[tuple, list[tuple[int, str]]] = {}
        for key in columns:
            for row in sorted(self._rivals):
                groups.setdefault((self.rows[row][:same], key), []).append((row, key))
        self._compared += groups.values()

    def require_rows(self, subject: str, verb: str, remedy: str) -> None:
        """Raise an InputError, such as "metrics: have no accuracy for table1_extended", if no row was added."""
        if not self.rows:
            raise InputError(subject, f"{verb} for {self.name}", remedy)

    def first_labels(self) -> list[str]:
        """Return the different keys of the rows' first labels, in the order of the rows."""
        return list(dict.fromkeys(labels[0][0] for labels in self.rows))

    def stand_in_clause(self, sources: Mapping[str, Mapping], partly: bool = True) -> str:
        """Return what the caption says of stand-ins among the sources that name the rows."""
        return stand_in_clause((sources[name] for name in self.first_labels()), partly)

    def most_seeds(self) -> int:
        """Return over how many seeds the cell with the most of them is a mean."""
        return max(cell.seeds for cell in self.cells.values())

    def span_of_seeds(self) -> str:
        """Return over how many seeds its cells are means, such as ``5`` or ``1 to 3``."""
        return span(cell.seeds for cell in self.cells.values())

    def build(self, caption: str, column_head: str, columns: Mapping[str, Column], footnotes: Iterable[str]) -> Table:
        """Return the table with its columns, which may depend on the cells that were found."""
        return Table(
            name=self.name,
            caption=caption,
            row_heads=self.row_heads,
            rows=tuple(self.rows),
            column_head=column_head,
            columns=columns,
            cells=self.cells,
            footnotes=tuple(footnotes),
            compared=tuple(self._compared),
        )


def cell_of_repeats(values_R: Collection[float], test_samples: int, at_least: bool = False) -> Cell | None:
    """Return the mean over R repeats with the half-width of its t-interval, or None without any repeat.

    Fewer than `LEAST_SEEDS` repeats have no interval.

    Args:
        values_R: One value per seed, in the column's unit.
        test_samples: The number of test samples of all seeds together.
        at_least: Whether some repeat was stopped before it was done, which makes the mean a lower bound.
    """
    if len(values_R) == 0:
        return None
    mean, low, _ = mean_interval(values_R)
    half_width = mean - low if len(values_R) >= LEAST_SEEDS else nan
    return Cell(mean, half_width, len(values_R), test_samples, at_least)


def cell_of_all_samples(values_R: Sequence[float], samples_R: Sequence[float]) -> Cell | None:
    """Return the mean over the samples of R seeds, which have unequally many, or None without any seed.

    The interval is that of a ratio of two means over the seeds (by its linearisation), which for equally many samples
    is the t-interval of the seeds' means.

    Args:
        values_R: The mean over the samples of each seed, in the column's unit.
        samples_R: How many these are.
    """
    value_R, sample_R = np.asarray(values_R, float), np.asarray(samples_R, float)
    if not len(value_R):
        return None
    mean = np.average(value_R, weights=sample_R)
    return cell_of_repeats(mean + sample_R / sample_R.mean() * (value_R - mean), int(sample_R.sum()))


def cell_over_sources(
    metrics: pd.DataFrame,
    values: pd.DataFrame,
    sources: Iterable[str],
    method: str,
    metric: str,
    concept: str,
    factor: float,
) -> Cell | None:
    """Return the mean over the seeds of what all pairs of a seed have, whatever their source."""
    counts = rows_where(metrics, method=method, metric="test_samples", concept=concept)
    of_metric = rows_where(values, method=method, metric=metric, concept=concept)
    both = of_metric.merge(counts, on=["source", "seed"], suffixes=("", "_n"))
    both = both[both["source"].isin(list(sources))]
    sums = (both["value"] * both["value_n"]).groupby(both["seed"]).sum()
    counts_R = both.groupby("seed")["value_n"].sum()
    return cell_of_repeats((factor * sums / counts_R).to_numpy(), int(counts_R.sum()))


def plain_cell(value: float, seeds: int, test_samples: int) -> Cell:
    """Return a number that has no interval."""
    return Cell(value, nan, seeds, test_samples)


def rows_where(frame: pd.DataFrame, **wanted: object) -> pd.DataFrame:
    """Return the rows whose columns hold what is wanted, e.g. ``rows_where(metrics, source="ycb", concept="all")``."""
    chosen = None
    for column, value in wanted.items():
        holds = frame[column] == value
        chosen = holds if chosen is None else chosen & holds
    return frame if chosen is None else frame[chosen]


def mean_over(seeds: int | str, samples: int | str) -> str:
    """Return the start of the footnote that most tables begin with; it ends with what ± means, without a full stop."""
    return f"Mean over {plural(seeds, 'seed')}, {samples} test samples each; {interval_over(seeds)}"


def interval_over(seeds: int | str) -> str:
    """Return what ± means in a table of means over so many seeds, such as ``5`` or ``1 to 3``, without a full stop."""
    fewest, most = (int(number) for number in (str(seeds).split()[0], str(seeds).split()[-1]))
    if most < LEAST_SEEDS:
        return f"with fewer than {LEAST_SEEDS} there is no interval and no bold"
    return INTERVAL if fewest >= LEAST_SEEDS else f"{INTERVAL} (none for fewer than {LEAST_SEEDS})"


def missing_packages(left_out: Mapping[str, str]) -> list[str]:
    """Return the footnote on methods whose package is not installed, if there are any."""
    if not left_out:
        return []
    told = ", ".join(f"{title} needs the package {package}" for title, package in left_out.items())
    return [f"Left out, as the package is not installed: {told}."]
