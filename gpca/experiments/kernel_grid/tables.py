"""Makes the tables of kernels and schedules (Table IV).

The intervals are what :func:`gpca.experiments.kernel_grid.intervals.collect_intervals` returned.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import TYPE_CHECKING

from gpca.experiments.kernel_grid.grid import BY_GPYTORCH, PRINTED, TABLE, setting_name
from gpca.objects.entry import stand_in_clause, title_of
from gpca.reporting.tables.builder import TableBuilder, interval_over, over_clusters
from gpca.reporting.tables.cells import cell_of_repeats, clustered_cell, rows_where
from gpca.reporting.tables.table import Cell, Column, Table

if TYPE_CHECKING:
    import pandas as pd

TITLES = {"rbf": "RBF", "matern32": "Matérn 3/2", "polynomial": "Polynomial, p = 2"}
TITLES |= {kernel + BY_GPYTORCH: f"{title}, by gpytorch" for kernel, title in TITLES.items()}
_GPYTORCH_NOTE = "By gpytorch: the same fit in gpytorch's own classes, from the same start and random numbers."
_HEADS = {"kernel": "Kernel", "learning_rate": "Rate", "iterations": "Iterations"}
_MEASURES = {  # Each measure of the grid has a column, and a factor to the column's unit.
    "accuracy": (Column("Accuracy (%)"), 100),
    "confidence": (Column("Confidence (%)", of_samples=False), 100),
    "ece": (Column("ECE (share)", decimals=3, limits=(0, 1), least_is_best=True), 1),
    "nll": (Column("NLL (nats)", decimals=3, limits=(0, inf), least_is_best=True), 1),
    "elbo": (Column("ELBO (nats)", decimals=3, limits=(-inf, inf)), 1),
}


def table4_kernels(intervals: pd.DataFrame, sources: Mapping[str, Mapping]) -> Table:
    """Return the accuracy of those of the paper's five kernels and schedules that were fitted, by sources."""
    shown = _shown(intervals, sources)
    table = TableBuilder("table4_kernels", _HEADS)
    again = [(kernel + BY_GPYTORCH, rate, iterations) for kernel, rate, iterations in PRINTED]
    for setting in (*PRINTED, *again):
        table.add_row(_labels(setting), {name: _cell(intervals, name, setting, "accuracy") for name in shown})
    table.compare_down(shown)
    return table.build(
        caption="Accuracy of the GPC by kernel and schedule (%)" + stand_in_clause(shown.values(), partly=False),
        column_head="source",
        columns={name: Column(title_of(entry)) for name, entry in shown.items()},
        footnotes=(
            f"{_repeats(table)}.",
            "The rows that the paper prints; table4_grid has all, with their confidence.",
            *_gpytorch_note(table),
        ),
    )


def table4_grid(grid: pd.DataFrame, intervals: pd.DataFrame, sources: Mapping[str, Mapping]) -> Table:
    """Return every kernel, learning rate and number of iterations on every source, with its calibration.

    Args:
        grid: What :func:`gpca.experiments.kernel_grid.grid.read_grids` returned.
    """
    shown = _shown(intervals, sources)
    settings = list(grid[list(_HEADS)].drop_duplicates().itertuples(index=False, name=None))
    table = TableBuilder("table4_grid", {"source": "Dataset", **_HEADS})
    for name, entry in shown.items():
        for setting in settings:
            cells = {measure: _cell(intervals, name, setting, measure) for measure in _MEASURES}
            elbo_R = rows_where(grid, source=name, **dict(zip(_HEADS, setting, strict=True)))["elbo"].to_numpy()
            cells["elbo"] = cell_of_repeats(elbo_R, 0)
            table.add_row([(name, title_of(entry)), *_labels(setting)], cells)
    table.compare_down(["accuracy", "nll"], same=1)
    return table.build(
        caption="The GPC by kernel, learning rate and iterations" + stand_in_clause(shown.values(), partly=False),
        column_head="measure",
        columns={measure: column for measure, (column, _) in _MEASURES.items()},
        footnotes=(
            f"{_repeats(table)}. Bold: best accuracy and NLL of a dataset.",
            "Confidence: mean of the largest score. ECE: its gap to the accuracy over 15 equally wide bins, mean of "
            "each seed's own. ELBO: per training sample, mean over the seeds; "
            f"{interval_over(table.most_seeds())}. If it still rises from row to row and the confidence lies far below "
            "the accuracy, the fit was stopped before it had converged.",
            *_gpytorch_note(table),
        ),
    )


def _gpytorch_note(table: TableBuilder) -> list[str]:
    """Return the footnote on the rows in gpytorch's own classes, if there are any."""
    return [_GPYTORCH_NOTE] if any(key.endswith(BY_GPYTORCH) for row in table.rows for key, _ in row) else []


def _shown(intervals: pd.DataFrame, sources: Mapping[str, Mapping]) -> dict[str, Mapping]:
    return {name: entry for name, entry in sources.items() if (intervals["source"] == name).any()}


def _repeats(table: TableBuilder) -> str:
    """Return the start of the footnote on seeds, samples and intervals, without a full stop."""
    table.require_rows()
    cell = next(cell for cell in table.cells.values() if cell.test_samples)
    return over_clusters(cell.seeds, cell.test_samples // cell.seeds)


def _labels(setting: tuple) -> tuple[tuple[str, str], ...]:
    kernel, rate, iterations = setting
    return (kernel, TITLES[kernel]), (f"{rate:g}", f"{rate:g}"), (str(iterations), str(iterations))


def _cell(intervals: pd.DataFrame, source: str, setting: tuple, measure: str) -> Cell | None:
    _, factor = _MEASURES[measure]
    method = setting_name(*setting)
    return clustered_cell(intervals, factor, table=TABLE, source=source, method=method, metric=measure)
