"""Makes Table IX: how well explainers say whether a registration failed, and why, by the measured truth."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import TYPE_CHECKING

from gpca.attribution.bootstrap import REPEATS
from gpca.diagnosis.judged import CEILING, POOLED
from gpca.objects.title import title_of
from gpca.reporting.tables.builder import TableBuilder, rows_where
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

SHOWN = {
    "balanced_accuracy": Column("Balanced (%)"),
    "lead": Column("Lead (points)", limits=(-100.0, 100.0)),
    "dominant_accuracy": Column("Dominant (%)"),
    "false_alarm_rate": Column("False alarms (%)", least_is_best=True),
    "auroc_failed": Column("AUROC", decimals=3, limits=(0.0, 1.0)),
    "average_precision": Column("mAP (%)", interval=False),
    "spearman_attribution": Column("Spearman", decimals=2, interval=False, limits=(-1.0, 1.0)),
    "deletion_gain": Column("Deletion (%)", interval=False),
    "nominal_calibration": Column("ECE (%)", interval=False, least_is_best=True),
    "samples": Column("n", decimals=0, interval=False, limits=(0.0, inf)),
}
_SHARES = (  # These are printed in %.
    *("balanced_accuracy", "dominant_accuracy", "false_alarm_rate"),
    *("average_precision", "deletion_gain", "nominal_calibration"),
)


def table9_causes(intervals: pd.DataFrame, sources: Mapping[str, Mapping], explainers: Mapping[str, str]) -> Table:
    """Return every measure of every explainer, by source and pooled, the ceiling last.

    Args:
        intervals: What :func:`gpca.diagnosis.intervals.collect` returned.
        sources: The ``{"title": str, "stand_in": bool}`` of each name, in the order of the rows.
        explainers: The title of each name, in order.

    Raises:
        InputError: The intervals hold none of these.
    """
    stand_ins = any(entry["stand_in"] for entry in sources.values())
    titles = {name: title_of(entry) for name, entry in sources.items()} | {POOLED: "All together"}
    table = TableBuilder("table9_causes", {"source": "Dataset", "explainer": "Explainer"})
    for source, title in titles.items():
        for explainer, words in {**explainers, CEILING: "Truth from other starts (ceiling)"}.items():
            rows = rows_where(intervals, source=source, method=explainer).set_index("metric")
            table.add_row([(source, title), (explainer, words)], _cells(rows), rival=explainer != CEILING)
    table.require_rows("intervals", "hold no diagnosis", "run its explainers first")
    table.compare_down([key for key in SHOWN if key not in ("lead", "samples")], same=1)
    return table.build(
        caption="What is wrong with a registration, if anything: objects that no explainer was trained on"
        + (", procedural stand-ins among them" if stand_ins else ""),
        column_head="metric",
        columns=SHOWN,
        footnotes=(
            f"n: test samples over {plural(table.most_seeds(), 'seed')}. ± is half the width of the 95 % interval of a "
            f"bootstrap over objects and seeds ({REPEATS} draws), whose bounds the CSV holds.",
            "Balanced: mean share named rightly of nominal and of the three dominant causes. Lead: balanced accuracy "
            "minus that of the best other explainer, on the same draws: it wins where the interval is above 0. "
            "Dominant: of the failed, the share whose main cause has the highest score among the causes.",
            "False alarms: share of the nominal above the alarm that finds 90 % of the failed. AUROC: of failed "
            "against nominal. mAP: mean average precision of the sets of causes. Spearman: of scores and measured "
            "attributions. Deletion: share of a failed sample's error that goes with the cause named first. "
            "ECE: expected calibration error of the score of nominal.",
            "Gates only say whether something is wrong. The ceiling is the truth measured again from other starts.",
        ),
    )


def _cells(rows: pd.DataFrame) -> dict[str, Cell | None]:
    """Return the cells of one source and explainer, from rows whose index is the metric."""
    cells: dict[str, Cell | None] = {}
    for metric in (name for name in SHOWN if name in rows.index):
        row, scale = rows.loc[metric], 100 if metric in _SHARES else 1
        cells[metric] = _cell(row, "value", "low", "high", scale)
        if metric == "balanced_accuracy" and row["rival"]:
            cells["lead"] = _cell(row, "difference", "difference_low", "difference_high", scale)
    if len(rows):
        row = rows.iloc[0]
        cells["samples"] = Cell(row["samples"], float("nan"), int(row["seeds"]), int(row["samples"]))
    return cells


def _cell(row: pd.Series, value: str, low: str, high: str, scale: float) -> Cell:
    bounds = (scale * row[low], scale * row[high])
    return Cell(scale * row[value], (bounds[1] - bounds[0]) / 2, int(row["seeds"]), int(row["samples"]), bounds=bounds)
