"""Makes the tables of registration methods: how often and how well each registers, from which start, by what cause.

The ``methods`` are ``{"title": str, "is_global": bool}`` here. Local ones start a second time at the pose of the global
method ``global_start``; ``left_out`` is the package that is missing, by the title of the method that needs it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import inf
from typing import TYPE_CHECKING

from gpca.alignment.pose_error import success_within
from gpca.evaluation.measures import ALL
from gpca.experiments.registration_methods.metrics import BINS, INITIAL, NO_START, POINTS, bin_name, row_name
from gpca.objects.entry import stand_in_clause
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.builder import TableBuilder, missing_packages, over_clusters
from gpca.reporting.tables.cells import cell_over_sources, clustered_cell, rows_where
from gpca.reporting.tables.table import Column, Table

if TYPE_CHECKING:
    import pandas as pd

_ERRORS = {  # Each of these metrics has a column, and a factor to the column's unit.
    "failed": (Column("Failed (%)", interval=False, least_is_best=True), 100),
    "add": (Column("ADD(-S) (% d)", limits=(0, inf), least_is_best=True), 100),
    "rotation_deg": (Column("Rotation (°)", limits=(0, 180), least_is_best=True), 1),
    "translation": (Column("Translation (% d)", limits=(0, inf), least_is_best=True), 100),
}
_POINTS = Column("Points", decimals=0, interval=False, limits=(0, inf))
_MILLISECONDS = Column("ms", interval=False, limits=(0, inf), least_is_best=True)


def table11_registration(
    intervals: pd.DataFrame,
    metrics: pd.DataFrame,
    seconds: pd.DataFrame,
    sources: Mapping[str, Mapping],
    methods: Mapping[str, Mapping],
    global_start: str,
    left_out: Mapping[str, str],
) -> Table:
    """Return successes in all and by cause, errors, points and milliseconds: starts × methods.

    Args:
        intervals: What :func:`gpca.experiments.registration_methods.intervals.collect_intervals` returned.
        metrics: What :func:`gpca.experiments.registration_methods.metrics.collect_trials` returned.
        seconds: What :func:`gpca.experiments.registration_methods.metrics.collect_seconds` returned.
    """
    table = _table("table11_registration")
    causes = (ALL, *CONCEPTS)
    for labels, name in _rows(methods, global_start):
        rows = rows_where(intervals, method=name)
        cells = {f"success_{cause}": clustered_cell(rows, metric="success", concept=cause) for cause in causes}
        cells |= {key: clustered_cell(rows, factor, metric=key, concept=ALL) for key, (_, factor) in _ERRORS.items()}
        cells[POINTS] = cell_over_sources(metrics, metrics, sources, name, POINTS, ALL, 1.0)
        cells["milliseconds"] = cell_over_sources(metrics, seconds, sources, name, "seconds", ALL, 1e3)
        table.add_row(labels, cells)
    columns = {f"success_{cause}": Column(f"{cause.capitalize()} (%)") for cause in causes}
    columns |= {key: column for key, (column, _) in _ERRORS.items()}
    table.compare_down(columns, same=1)
    return table.build(
        caption="Registrations that succeed, and how far all are off" + stand_in_clause(sources.values()),
        column_head="metric",
        columns=columns | {POINTS: _POINTS, "milliseconds": _MILLISECONDS},
        footnotes=(
            *_notes(table, intervals, left_out),
            "Errors are means over all registrations, at the last pose of those that failed; rotations up to the "
            "object's symmetries. Failed: given up by the method itself, or not at rest. Points: of a cloud, on "
            "average over sources and targets; behind a global start, the local method's. ms: of one registration, "
            "with its global start if it has one, without the normals; the only column that differs from run to run.",
        ),
    )


def table11_limits(
    intervals: pd.DataFrame,
    sources: Mapping[str, Mapping],
    methods: Mapping[str, Mapping],
    global_start: str,
    left_out: Mapping[str, str],
    curve: Iterable[float],
) -> Table:
    """Return successes by the error below which a registration is one: starts × methods by limits of `curve`."""
    table = _table("table11_limits")
    columns = {success_within(limit): Column(f"{100 * limit:g} % d (%)") for limit in curve}
    for labels, name in _rows(methods, global_start):
        rows = rows_where(intervals, method=name, concept=ALL)
        table.add_row(labels, {key: clustered_cell(rows, metric=key) for key in columns})
    table.compare_down(columns, same=1)
    return table.build(
        caption="Registrations that succeed, by the error that is allowed" + stand_in_clause(sources.values()),
        column_head="error below",
        columns=columns,
        footnotes=_notes(table, intervals, left_out),
    )


def table11_severity(
    intervals: pd.DataFrame,
    sources: Mapping[str, Mapping],
    methods: Mapping[str, Mapping],
    global_start: str,
    left_out: Mapping[str, str],
) -> Table:
    """Return successes by cause and severity: starts × methods by causes × bins."""
    table = _table("table11_severity")
    columns = {
        bin_name(cause, severity): Column(f"{cause.capitalize()}, {severity} (%)", decimals=0)
        for cause in CONCEPTS
        for severity in BINS
    }
    for labels, name in _rows(methods, global_start):
        rows = rows_where(intervals, method=name, metric="success")
        table.add_row(labels, {key: clustered_cell(rows, concept=key) for key in columns})
    table.compare_down(columns, same=1)
    pairs = {key: cell.test_samples for (_, key), cell in table.cells.items()}
    return table.build(
        caption="Registrations that succeed, by cause and severity (%)" + stand_in_clause(sources.values()),
        column_head="cause",
        columns=columns,
        footnotes=(
            *_notes(table, intervals, left_out),
            "Low, middle, high: thirds of what is drawn; a pose error counts by the mean of its places in the two "
            f"ranges. Pairs of all seeds, by column: {', '.join(str(pairs.get(key, 0)) for key in columns)}.",
        ),
    )


def _table(name: str) -> TableBuilder:
    return TableBuilder(name, {"start": "Start", "method": "Method"})


def _rows(methods: Mapping[str, Mapping], global_start: str) -> Iterable[tuple[list[tuple[str, str]], str]]:
    """Yield the labels of each row and its method in the metrics, start by start."""
    starts = {INITIAL: "Initial pose", NO_START: "None"}
    if global_start in methods:
        starts[global_start] = methods[global_start]["title"]
    for start, title in starts.items():
        for name, entry in methods.items():
            if entry["is_global"] == (start == NO_START):
                yield [(start, title), (name, entry["title"])], row_name(name, start)


def _notes(table: TableBuilder, intervals: pd.DataFrame, left_out: Mapping[str, str]) -> list[str]:
    table.require_rows()
    pairs = int(rows_where(intervals, concept=ALL)["samples"].max())
    notes = [
        f"{over_clusters(table.most_seeds(), pairs // table.most_seeds())}. A success is off by less than the config's "
        "`success.error` of the diameter d, ADD or, for symmetric objects, ADD-S. A registration that failed by the "
        "method's own account is no success. Bold: best of a start."
    ]
    return [*notes, *missing_packages(left_out)]
