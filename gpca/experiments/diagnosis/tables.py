"""Makes Tables IX: how well explainers say whether a registration failed, and why, by the measured truth."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, isfinite
from typing import TYPE_CHECKING

from gpca.causes.judged import CEILING
from gpca.evaluation.intervals import REPEATS
from gpca.evaluation.measures import POOLED
from gpca.experiments.diagnosis.near_chance import rule_near_chance
from gpca.experiments.frame_causes.metrics import STATE
from gpca.explainers.interface import WORDS
from gpca.reporting.tables.builder import Label, TableBuilder, crossed, titles_of
from gpca.reporting.tables.cells import interval_cell, plain_cell, rows_where
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

SHOWN = {
    "regret": Column("Regret (%)", limits=(0.0, inf), least_is_best=True),
    "tied_accuracy": Column("With ties (%)"),
    "balanced_accuracy": Column("Balanced (%)"),
    "gain": Column("Over untrained (points)", limits=(-100.0, 100.0)),
    "lead": Column("Lead (points)", limits=(-100.0, 100.0)),
    "dominant_accuracy": Column("Dominant (%), chance 33.3"),
    "false_alarm_rate": Column("False alarms (%)", least_is_best=True),
    "auroc_failed": Column("AUROC", decimals=3, limits=(0.0, 1.0)),
    "average_precision": Column("mAP (%)", interval=False),
    "spearman_attribution": Column("Spearman", decimals=2, interval=False, limits=(-1.0, 1.0)),
    "nominal_calibration": Column("ECE (share)", 3, False, (0.0, 1.0), least_is_best=True),
    "icp_calls": Column("ICP calls", decimals=0, interval=False, limits=(0.0, inf)),
    "samples": Column("n", decimals=0, interval=False, limits=(0.0, inf)),
}
DIFFERENCES = {  # column -> its difference, and the names of its bounds, in a row of the intervals
    "gain": ("gain", ("gain_low", "gain_high")),
    "lead": ("difference", ("difference_low", "difference_high")),
}
NOT_COMPARED = (*DIFFERENCES, "icp_calls", "samples")
AGAIN = {CEILING: "Truth from other starts (counterfactual access)"}
COSTS = {CEILING: {"sees": WORDS["truth"], "icp_calls": None}}
ROW_HEADS = {"explainer": "Explainer", "reads": "Reads"}
COST_NOTE = "Reads: what an explainer sees of a registration. ICP calls: runs beyond the one that it explains."
_SHARES = (  # These are printed in %.
    STATE,
    *("regret", "tied_accuracy", "balanced_accuracy", "dominant_accuracy", "false_alarm_rate", "average_precision"),
)


def table9_causes(
    intervals: pd.DataFrame,
    sources: Mapping[str, Mapping],
    explainers: Mapping[str, str],
    costs: Mapping[str, Mapping],
) -> Table:
    """Return every measure of every explainer, by source and pooled, the ceiling last.

    Args:
        intervals: What :func:`gpca.experiments.diagnosis.metrics.collect_intervals` returned.
        costs: What each explainer ``sees``, in words, and its number of ``icp_calls``.
    """
    stand_ins = any(entry["stand_in"] for entry in sources.values())
    titles = titles_of(sources) | {POOLED: "All together"}
    costs = {**costs, **COSTS}
    table = TableBuilder("table9_causes", {"source": "Dataset", **ROW_HEADS})
    for (source, explainer), labels in crossed(titles, {**explainers, **AGAIN}):
        rows = rows_where(intervals, source=source, method=explainer).set_index("metric")
        cells = cells_of(rows, SHOWN, "balanced_accuracy", costs[explainer])
        table.add_row([*labels, reads(costs[explainer])], cells, rival=explainer != CEILING)
    table.compare_down([key for key in SHOWN if key not in NOT_COMPARED], same=1)
    return table.build(
        caption="What is wrong with a registration, if anything: objects that no explainer was trained on"
        + (", procedural stand-ins among them" if stand_ins else ""),
        column_head="metric",
        columns=SHOWN,
        footnotes=(
            f"n: test samples that are judged, over {plural(table.most_seeds(), 'seed')}; borderline ones are left "
            f"out. Of them, {_parts(intervals, titles)}. In brackets: the 95 % interval of a bootstrap over objects "
            f"and seeds ({REPEATS} draws). Bold: best explainer on a dataset.",
            "Regret: of the failed, the share of the error that removing the best single cause would take away and "
            "removing the named one does not; who names nominal removes nothing. With ties: as Dominant, but any cause "
            "counts whose φ is within the limit of a cause (1 % of the diameter by default) of the largest.",
            "Balanced: mean share named rightly of nominal and of the three dominant causes. Over untrained: balanced "
            "accuracy minus that of the best of chance, the most frequent label and the rule; lead: minus that of the "
            "best other explainer; both on the same draws, so that it is better where the interval is above 0. "
            "Dominant: of the failed alone, the share whose main cause has the highest score among the causes. No gate "
            "of nominal helps with that, and guessing is right in 33.3 %."
            + rule_near_chance(intervals, sources, metric="dominant_accuracy"),
            "False alarms: share of the nominal above the alarm that finds 90 % of the failed. AUROC: of failed "
            "against nominal. mAP: mean average precision of the sets of causes. Spearman: of scores and measured "
            "attributions of the failed. ECE: expected calibration error of the score of nominal.",
            "Gates only say whether something is wrong. The last row is the truth measured again from other starts; it "
            "has the true pose and the clean clouds, which no observer has: nothing says that it can be reached.",
            COST_NOTE,
        ),
    )


def _parts(intervals: pd.DataFrame, titles: Mapping[str, str]) -> str:
    """Return how many samples of each source are nominal and how many failed, in words."""
    parts = {}
    for source, title in titles.items():
        samples = rows_where(intervals, source=source).groupby("metric")["samples"].max()
        nominal, judged = samples.get("false_alarm_rate"), samples.max()
        if source != POOLED and nominal is not None:
            parts[title] = f"{nominal:.0f} are nominal and {judged - nominal:.0f} failed"
    if len(parts) > 1 and len(set(parts.values())) == 1:
        return f"{next(iter(parts.values()))} on each dataset"
    return "; ".join(f"{words} on {title}" for title, words in parts.items())


def reads(cost: Mapping) -> Label:
    """Return the label of what an explainer sees."""
    return cost["sees"], cost["sees"]


def cells_of(rows: pd.DataFrame, shown: Mapping[str, Column], compared: str, cost: Mapping) -> dict[str, Cell | None]:
    """Return the cells of one source and explainer, from rows whose index is the metric; one of them is compared."""
    cells: dict[str, Cell | None] = {}
    for metric in (name for name in shown if name in rows.index):
        row, scale = rows.loc[metric], 100 if metric in _SHARES else 1
        cells[metric] = interval_cell(row, factor=scale)
        for key, names in DIFFERENCES.items():
            if metric == compared and key in shown and isfinite(row[names[0]]):
                cells[key] = interval_cell(row, *names, scale)
    if len(rows):
        judged, seeds = rows["samples"].max(), int(rows["seeds"].iloc[0])
        cells["samples"] = plain_cell(judged, seeds, int(judged))
        if cost["icp_calls"] is not None:
            cells["icp_calls"] = plain_cell(cost["icp_calls"], seeds, int(judged))
    return cells
