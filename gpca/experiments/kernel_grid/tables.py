"""Makes the tables of kernels and schedules (Table IV) from :mod:`gpca.experiments.kernel_grid.grid`."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import TYPE_CHECKING

from gpca.objects.title import stand_in_clause, title_of
from gpca.reporting.tables.builder import TableBuilder, mean_over
from gpca.reporting.tables.cells import cell_of_repeats, rows_where
from gpca.reporting.tables.table import Cell, Column, Table

if TYPE_CHECKING:
    import pandas as pd

TITLES = {"rbf": "RBF", "matern32": "Matérn 3/2", "polynomial": "Polynomial, p = 2"}
PRINTED = (  # The paper's table has these rows.
    ("rbf", 0.01, 100),
    ("matern32", 0.01, 200),
    ("polynomial", 0.01, 200),
    ("rbf", 0.001, 200),
    ("polynomial", 0.001, 200),
)
_HEADS = {"kernel": "Kernel", "learning_rate": "Rate", "iterations": "Iterations"}
_MEASURES = {  # Each measure of the grid has a column, and a factor to the column's unit.
    "accuracy": (Column("Accuracy (%)"), 100),
    "confidence": (Column("Confidence (%)", of_samples=False), 100),
    "ece": (Column("ECE (share)", decimals=3, limits=(0, 1), least_is_best=True), 1),
    "nll": (Column("NLL (nats)", decimals=3, limits=(0, inf), least_is_best=True), 1),
    "elbo": (Column("ELBO (nats)", decimals=3, limits=(-inf, inf)), 1),
}


def table4_kernels(grid: pd.DataFrame, sources: Mapping[str, Mapping], test: int) -> Table:
    """Return the accuracy of those of the paper's five kernels and schedules that were fitted, by sources."""
    shown = {name: entry for name, entry in sources.items() if (grid["source"] == name).any()}
    table = TableBuilder("table4_kernels", _HEADS)
    for setting in PRINTED:
        table.add_row(_labels(setting), {name: _cell(grid, name, setting, "accuracy", test) for name in shown})
    table.compare_down(shown)
    return table.build(
        caption="Accuracy of the GPC by kernel and schedule (%)" + stand_in_clause(shown.values(), partly=False),
        column_head="source",
        columns={name: Column(title_of(entry)) for name, entry in shown.items()},
        footnotes=(
            f"{mean_over(table.most_seeds(), test)}.",
            "The rows that the paper prints; table4_grid has all, with their confidence.",
        ),
    )


def table4_grid(grid: pd.DataFrame, sources: Mapping[str, Mapping], test: int) -> Table:
    """Return every kernel, learning rate and number of iterations on every source, with its calibration."""
    shown = {name: entry for name, entry in sources.items() if (grid["source"] == name).any()}
    settings = list(grid[list(_HEADS)].drop_duplicates().itertuples(index=False, name=None))
    table = TableBuilder("table4_grid", {"source": "Dataset", **_HEADS})
    for name, entry in shown.items():
        for setting in settings:
            cells = {measure: _cell(grid, name, setting, measure, test) for measure in _MEASURES}
            table.add_row([(name, title_of(entry)), *_labels(setting)], cells)
    table.compare_down(["accuracy", "nll"], same=1)
    return table.build(
        caption="The GPC by kernel, learning rate and iterations" + stand_in_clause(shown.values(), partly=False),
        column_head="measure",
        columns={measure: column for measure, (column, _) in _MEASURES.items()},
        footnotes=(
            f"{mean_over(table.most_seeds(), test)}. Bold: best accuracy and NLL of a dataset.",
            "Confidence: mean of the largest score. ECE: its gap to the accuracy over 15 equally wide bins. ELBO: per "
            "training sample. If the ELBO still rises from row to row and the confidence lies far below the "
            "accuracy, the fit was stopped before it had converged.",
        ),
    )


def _labels(setting: tuple) -> tuple[tuple[str, str], ...]:
    kernel, rate, iterations = setting
    return (kernel, TITLES[kernel]), (f"{rate:g}", f"{rate:g}"), (str(iterations), str(iterations))


def _cell(grid: pd.DataFrame, source: str, setting: tuple, measure: str, test: int) -> Cell | None:
    of_setting = rows_where(grid, source=source, **dict(zip(_HEADS, setting, strict=True)))
    _, factor = _MEASURES[measure]
    return cell_of_repeats(of_setting[measure].to_numpy() * factor, test * len(of_setting))
