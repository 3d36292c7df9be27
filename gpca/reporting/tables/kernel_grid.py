"""The tables of kernels and schedules (paper, Table IV), from the grids of :mod:`gpca.classifier.kernel_grid`.

Both take the same arguments and raise the same error:

    grid: as :func:`gpca.classifier.kernel_grid.read_grids` returns it.
    sources: name -> ``{"title": str, "stand_in": bool}``, in the order in which they are shown.
    test: test samples of each seed.
    InputError: the grid holds none of the sources, or none of the rows.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import TYPE_CHECKING

from gpca.attribution.metrics import mean_interval
from gpca.errors import InputError
from gpca.objects.title import STAND_IN, title_of
from gpca.reporting.tables.table import Cell, Cells, Column, Rows, Table

if TYPE_CHECKING:
    import pandas as pd

TITLES = {"rbf": "RBF", "matern32": "Matérn 3/2", "polynomial": "Polynomial, p = 2"}
PRINTED = (  # the rows of the paper's table
    ("rbf", 0.01, 100),
    ("matern32", 0.01, 200),
    ("polynomial", 0.01, 200),
    ("rbf", 0.001, 200),
    ("polynomial", 0.001, 200),
)
_KEYS = ["kernel", "learning_rate", "iterations"]
_MEASURES = {  # of the grid -> column, and the factor to its unit
    "accuracy": (Column("Accuracy (%)"), 100),
    "confidence": (Column("Confidence (%)"), 100),
    "ece": (Column("ECE (%)", least_is_best=True), 100),
    "nll": (Column("NLL (nats)", decimals=3, limits=(0, inf), least_is_best=True), 1),
    "elbo": (Column("ELBO (nats)", decimals=3, limits=(-inf, inf)), 1),
}


def table4_kernels(grid: pd.DataFrame, sources: Mapping[str, Mapping], test: int) -> Table:
    """Accuracy of the paper's five kernels and schedules: settings by sources; those that were fitted."""
    shown = {name: entry for name, entry in sources.items() if (grid["source"] == name).any()}
    rows: Rows = []
    cells: Cells = {}
    for setting in PRINTED:
        of_row = {name: cell for name in shown if (cell := _cell(grid, name, setting, "accuracy", test))}
        cells |= {(len(rows), name): cell for name, cell in of_row.items()}
        rows += [_labels(setting)] if of_row else []
    return _table(
        shown,
        rows,
        cells,
        test,
        name="table4_kernels",
        caption="Accuracy of the GPC by kernel and schedule (%)",
        columns={name: Column(title_of(entry)) for name, entry in shown.items()},
        column_head="source",
        row_heads=_heads(),
        compared=tuple([(row, name) for row in range(len(rows))] for name in shown),
        notes=("The rows that the paper prints; table4_grid has all, with their confidence.",),
    )


def table4_grid(grid: pd.DataFrame, sources: Mapping[str, Mapping], test: int) -> Table:
    """Every kernel, learning rate and number of iterations on every source, with confidence and calibration."""
    shown = {name: entry for name, entry in sources.items() if (grid["source"] == name).any()}
    rows: Rows = []
    cells: Cells = {}
    settings = list(grid[_KEYS].drop_duplicates().itertuples(index=False, name=None))
    for name, entry in shown.items():
        for setting in settings:
            of_row = {m: cell for m in _MEASURES if (cell := _cell(grid, name, setting, m, test))}
            cells |= {(len(rows), measure): cell for measure, cell in of_row.items()}
            rows += [((name, title_of(entry)), *_labels(setting))] if of_row else []
    groups = [
        [(row, measure) for row, labels in enumerate(rows) if labels[0][0] == name]
        for name in shown
        for measure in ("accuracy", "nll")
    ]
    return _table(
        shown,
        rows,
        cells,
        test,
        name="table4_grid",
        caption="The GPC by kernel, learning rate and iterations",
        columns={measure: column for measure, (column, _) in _MEASURES.items()},
        column_head="measure",
        row_heads={"source": "Dataset", **_heads()},
        compared=tuple(groups),
        notes=(
            "Confidence: mean of the largest score. ECE: its gap to the accuracy over 15 equally wide bins. ELBO: per "
            "training sample. Where the ELBO still rises from row to row and the confidence lies far below the "
            "accuracy, the fit was stopped before it had converged.",
        ),
    )


KERNEL_TABLES = {table.__name__: table for table in (table4_kernels, table4_grid)}


def kernel_tables_of(kernels: Mapping) -> list[str]:
    """Return the names of the tables that have a row, given the config's section ``kernel_grid``."""
    has_printed = any(
        kernel in kernels["kernels"] and rate in kernels["learning_rates"] and iterations in kernels["iterations"]
        for kernel, rate, iterations in PRINTED
    )
    return [name for name in KERNEL_TABLES if has_printed or name != "table4_kernels"]


def _heads() -> dict[str, str]:
    return {"kernel": "Kernel", "learning_rate": "Rate", "iterations": "Iterations"}


def _labels(setting: tuple) -> tuple[tuple[str, str], ...]:
    kernel, rate, iterations = setting
    return (kernel, TITLES[kernel]), (f"{rate:g}", f"{rate:g}"), (str(iterations), str(iterations))


def _cell(grid: pd.DataFrame, source: str, setting: tuple, measure: str, test: int) -> Cell | None:
    chosen = (grid["source"] == source) & (grid[_KEYS] == list(setting)).all(axis=1)
    values_R = grid.loc[chosen, measure].to_numpy() * _MEASURES[measure][1]
    if not len(values_R):
        return None
    mean, low, _ = mean_interval(values_R)
    return Cell(mean, mean - low, len(values_R), test * len(values_R))


def _table(shown: Mapping, rows: list, cells: Mapping, test: int, *, caption: str, notes: tuple[str, ...], **fields):
    if not cells:
        raise InputError("kernels", f"hold nothing for {fields['name']}", "run its sources and iterations first")
    if any(entry["stand_in"] for entry in shown.values()):
        caption += f", on {STAND_IN}s of the datasets' objects"
    seeds = max(cell.seeds for cell in cells.values())
    repeats = (
        f"Mean over {seeds} seed{'s' * (seeds != 1)}, {test} test samples each; ± is the half-width of the 95 % "
        "t-interval over the seeds."
    )
    return Table(caption=caption, rows=tuple(rows), cells=cells, footnotes=(repeats, *notes), **fields)
