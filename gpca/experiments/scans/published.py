"""Recalls on 3DMatch and 3DLoMatch beside published ones: the same criterion and lists, with other features."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.experiments.scans.metrics import CLOSE, CLOSE_DEG, CLOSE_M, LISTS
from gpca.reporting.tables.builder import TableBuilder, over_clusters
from gpca.reporting.tables.cells import clustered_cell, plain_cell, rows_where
from gpca.reporting.tables.table import Column, Table

if TYPE_CHECKING:
    import pandas as pd

PUBLISHED = Path(__file__).with_name("published.csv")


def table17_published(
    intervals: pd.DataFrame, titles: Mapping[str, str], benchmarks: Sequence[str], methods: Mapping[str, Mapping]
) -> Table:
    """Return recalls by list of global methods: this run's on each benchmark, and published ones.

    Args:
        intervals: what :func:`gpca.experiments.scans.metrics.collect_scans` returned.
        benchmarks: the data sets that are 3DMatch's.
        methods: ``{"title": str, "is_global": bool}`` by name.
    """
    table = TableBuilder("table17_published", {"by": "By", "method": "Method", "features": "Features"})
    for dataset in benchmarks:
        for name, entry in methods.items():
            if entry["is_global"]:
                rows = rows_where(intervals, source=dataset, method=name, metric=CLOSE)
                labels = [("run", f"This run, {titles[dataset]}"), (name, entry["title"]), ("FPFH", "FPFH")]
                table.add_row(labels, {key: clustered_cell(rows, concept=key) for key in LISTS})
    seeds = table.most_seeds()
    with PUBLISHED.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    for title in dict.fromkeys(row["title"] for row in rows):
        of_title = [row for row in rows if row["title"] == title]
        first = of_title[0]
        labels = [("published", "Published"), (first["method"], title), (first["features"], first["features"])]
        table.add_row(labels, {row["list"]: plain_cell(float(row["recall"]), 1, 0) for row in of_title}, rival=False)
    sources = "; ".join(dict.fromkeys(row["source"] for row in rows))
    return table.build(
        caption="Recall of 3DMatch and 3DLoMatch beside published recalls",
        column_head="list",
        columns={name: Column(f"{name}, overlap {low:g} to {high:g} (%)") for name, (low, high) in LISTS.items()},
        footnotes=(
            f"{over_clusters(seeds, clusters=('scenes', 'scene'))}. Correct: rotation off by less than {CLOSE_DEG:g}° "
            f"and translation by less than {100 * CLOSE_M:g} cm, as where the others were published: {sources}. Those "
            "match learned features (FCGF) on all pairs of the benchmark's eight scenes; this run has a sample of the "
            "pairs, as many of each stratum, of the scenes that it was given.",
        ),
    )
