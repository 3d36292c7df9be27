"""Makes the tables of registration methods on scans: recall by overlap, and by the rung that local methods start on.

The ``methods`` are ``{"title": str, "is_global": bool}``. Local ones start a second time at the pose of the global
method ``global_start``; ``left_out`` is the package that is missing, by the title of the method that needs it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from math import inf
from typing import TYPE_CHECKING, Any

from gpca.evaluation.measures import ALL
from gpca.experiments.registration_methods import row_name
from gpca.experiments.scans.metrics import FAILED, RECALL
from gpca.reporting.tables.builder import TableBuilder, missing_packages, over_clusters
from gpca.reporting.tables.cells import cell_of_repeats, clustered_cell, rows_where
from gpca.reporting.tables.table import Column, Table
from gpca.reporting.words import plural
from gpca.scans.pair import Rung
from gpca.scans.scene import stratum_name
from gpca.steps.registration_trials import INITIAL, NO_START

if TYPE_CHECKING:
    import pandas as pd

SCENES = ("scenes", "scene")  # what clusters are


def table17_scans(
    intervals: pd.DataFrame,
    seconds: pd.DataFrame,
    titles: Mapping[str, str],
    methods: Mapping[str, Mapping],
    global_start: str,
    strata: Sequence[float],
    success: Mapping[str, float],
    left_out: Mapping[str, str],
    missing: Mapping[str, str],
) -> Table:
    """Return recalls in all and by stratum of overlap, and seconds: data sets × starts × methods.

    Args:
        intervals: what :func:`gpca.experiments.scans.metrics.collect_scans` returned.
        seconds: what :func:`gpca.experiments.registration_methods.read_seconds` returned.
        titles: of the data sets.
        missing: where a data set is found that is not there, by its title.
    """
    table = TableBuilder("table17_scans", {"data": "Scans", "start": "Start", "method": "Method"})
    ends = {stratum_name(*pair): pair for pair in pairwise(strata)}
    for name, title in titles.items():
        for labels, row in _rows(methods, global_start):
            rows = rows_where(intervals, source=name, method=row)
            cells = {key: clustered_cell(rows, metric=RECALL, concept=key) for key in (*ends, ALL)}
            cells["failed"] = clustered_cell(rows, metric=FAILED, concept=ALL)
            if (cell := cells[ALL]) is not None:
                of_row = rows_where(seconds, source=name, method=row, metric="seconds")["value"]
                cells["seconds"] = cell_of_repeats(of_row.to_numpy(), cell.test_samples)
            table.add_row([(name, title), *labels], cells)
    columns = {key: Column(f"{low:g} to {high:g} (%)") for key, (low, high) in ends.items()}
    columns |= {
        ALL: Column("All (%)"),
        "failed": Column("Failed (%)", interval=False, least_is_best=True),
        "seconds": Column("s", decimals=2, interval=False, limits=(0, inf), least_is_best=True),
    }
    table.compare_down(columns, same=2)
    return table.build(
        caption="Registrations of scans that succeed, by overlap",
        column_head="overlap",
        columns=columns,
        footnotes=(
            *_notes(table, intervals, titles, [*ends], success, left_out, missing),
            "Failed: given up by the method itself, or not at rest; the pose counts in the other columns all the same. "
            "s: of one registration, with its global start if it has one, without voxels and normals; the only column "
            "that differs from run to run.",
        ),
    )


def table17_ladder(
    intervals: pd.DataFrame,
    titles: Mapping[str, str],
    methods: Mapping[str, Mapping],
    global_start: str,
    ladder: Iterable[Mapping[str, float]],
    success: Mapping[str, float],
    left_out: Mapping[str, str],
    missing: Mapping[str, str],
) -> Table:
    """Return recalls of local methods by the rung that they start on: data sets × methods by rungs."""
    table = TableBuilder("table17_ladder", {"data": "Scans", "method": "Method"})
    rungs = {Rung(**rung).name: Rung(**rung) for rung in ladder}
    for name, title in titles.items():
        for (start, method), row in _rows(methods, global_start):
            if start[0] == INITIAL:
                rows = rows_where(intervals, source=name, method=row, metric=RECALL)
                table.add_row([(name, title), method], {key: clustered_cell(rows, concept=key) for key in rungs})
    columns = {key: Column(f"{rung.rotation_deg:g}°, {rung.translation_m:g} m (%)") for key, rung in rungs.items()}
    table.compare_down(columns, same=1)
    return table.build(
        caption="Registrations of scans that succeed, by the error of the start",
        column_head="start",
        columns=columns,
        footnotes=_notes(table, intervals, titles, [*rungs], success, left_out, missing),
    )


def _rows(methods: Mapping[str, Mapping], global_start: str) -> Iterable[tuple[list[tuple[str, str]], str]]:
    """Yield the labels of start and method of each row, and its name in the metrics, start by start."""
    starts = {INITIAL: "Ladder", NO_START: "None"}
    if global_start in methods:
        starts[global_start] = methods[global_start]["title"]
    for start, title in starts.items():
        for name, entry in methods.items():
            if entry["is_global"] == (start == NO_START):
                yield [(start, title), (name, entry["title"])], row_name(name, start)


def _notes(
    table: TableBuilder,
    intervals: pd.DataFrame,
    titles: Mapping[str, str],
    concepts: Sequence[str],
    success: Mapping[str, Any],
    left_out: Mapping[str, str],
    missing: Mapping[str, str],
) -> list[str]:
    """Return what both tables say below: the pairs, the intervals, and what is correct."""
    table.require_rows()
    counts = []
    for name in table.first_labels():
        samples = rows_where(intervals, source=name, metric=RECALL).groupby("concept")["samples"].max()
        clusters = int(rows_where(intervals, source=name, metric=RECALL, concept=ALL)["clusters"].max())
        of_each = ", ".join(str(int(samples.get(concept, 0))) for concept in concepts)
        counts.append(f"{titles[name]}: {of_each}, of {plural(clusters, 'scene')}")
    absent = ", ".join(f"{title} ({address})" if address else title for title, address in missing.items())
    return [
        f"{over_clusters(table.most_seeds(), clusters=SCENES)}. Correct: the RMSE over the points that the target has "
        f"as well is below {success['room_m']:g} m in rooms and {100 * success['object_share']:g} % of the size of "
        "objects. Bold: best of a start.",
        f"Pairs of all seeds, by column: {'; '.join(counts)}.",
        *([f"Not there, so left out: {absent}."] if absent else []),
        *missing_packages(left_out),
    ]
