"""Makes Table XVIII: who tells failed registrations of scans and names their causes; and how many there are of each."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, isfinite
from typing import TYPE_CHECKING

from gpca.causes.judged import CEILING
from gpca.causes.scans import GLOBAL, LADDER
from gpca.causes.truth import BORDERLINE, GEOMETRY, NOMINAL
from gpca.evaluation.intervals import REPEATS
from gpca.evaluation.measures import POOLED
from gpca.experiments.diagnosis.tables import AGAIN, COST_NOTE, COSTS, SHOWN, reads
from gpca.experiments.frame_causes.tables import FEWEST_FAILURES
from gpca.experiments.scan_causes.metrics import ADDED, CAUSES, EVERY, FEWEST_OF_A_CAUSE, GATE, NATURAL, SAMPLES, TRUTH
from gpca.experiments.scan_causes.settings import OBJECTS, SCANS
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.builder import TableBuilder
from gpca.reporting.tables.cells import interval_cell, plain_cell, rows_where
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

LEARNED = {OBJECTS: "objects", SCANS: "other scenes", "": "–"}
LEAD = "lead"
COLUMNS = {
    "auroc_failed": SHOWN["auroc_failed"],
    LEAD: Column("AUROC over the best gate", decimals=3, limits=(-1.0, 1.0)),
    "false_alarm_rate": SHOWN["false_alarm_rate"],
    "state_accuracy": Column("State (%)"),
    CAUSES: Column("Cause, balanced (%)"),
    "regret": SHOWN["regret"],
    "icp_calls": SHOWN["icp_calls"],
    "samples": SHOWN["samples"],
}
NOT_COMPARED = (LEAD, "icp_calls", "samples")
FRACTION = ("auroc_failed",)  # printed as it is; all else in %
COUNTS = {
    "registrations": "Registrations",
    "pairs": "Pairs",
    "clusters": "Scenes",
    NOMINAL: "Nominal",
    BORDERLINE: "Borderline",
    "failed": "Failed",
    **{name: f"By {name}" for name in CONCEPTS},
    GEOMETRY: "Without a cause",
    "missed": "No correspondence",
}
STARTS = {
    NATURAL: "Natural: all starts",
    f"{NATURAL}_{LADDER}": "Natural: ladder of errors",
    f"{NATURAL}_{GLOBAL}": "Natural: global method",
}


def table18_scan_causes(
    measured: pd.DataFrame, scans: Mapping[str, str], explainers: Mapping[str, str], costs: Mapping[str, Mapping]
) -> Table:
    """Return how well explainers tell natural failures of scans, and their causes, by data set and where they learned.

    Args:
        measured: What :func:`gpca.experiments.scan_causes.metrics.read_scan_causes` returned.
        scans: Titles of the data sets.
        costs: As for :func:`gpca.experiments.diagnosis.tables.table9_causes`.
    """
    costs, titles = {**costs, **COSTS}, {POOLED: "All together", **scans}
    table = TableBuilder(
        "table18_scan_causes", {"scans": "Scans", "explainer": "Explainer", "learned": "Learned from", "reads": "Reads"}
    )
    natural = rows_where(measured, condition=NATURAL, stratum=EVERY)
    counts = {name: counted(measured, name, NATURAL, EVERY) for name in titles}
    for name in (name for name in titles if counts[name]):
        n_failed, n_nominal = failed(counts[name]), counts[name][NOMINAL]
        enough = min(n_failed, n_nominal) >= FEWEST_FAILURES
        title = f"{titles[name]} ({n_failed} failed, {n_nominal} nominal{'' if enough else ': too few'})"
        for explainer, words in {**explainers, **AGAIN}.items():
            for learned, words_of_learned in LEARNED.items():
                rows = rows_where(natural, source=name, method=explainer, learned=learned).set_index("metric")
                labels = [(name, title), (explainer, words), (learned, words_of_learned), reads(costs[explainer])]
                table.add_row(labels, _cells(rows, costs[explainer]), rival=enough and explainer != CEILING)
    table.require_rows()
    table.compare_down([key for key in COLUMNS if key not in NOT_COMPARED], same=1)
    return table.build(
        caption="Who tells failed registrations of scans to scans, and names their causes, with nothing added to them",
        column_head="metric",
        columns=COLUMNS,
        footnotes=(
            *(in_words(titles[name], of) for name, of in counts.items() if of),
            f"n: registrations that are nominal or failed, over {plural(table.most_seeds(), 'seed')}. In brackets: the "
            f"95 % interval of {REPEATS} bootstrap draws over scenes. Too few: below {FEWEST_FAILURES} failed or "
            "nominal ones nothing is concluded, and no row is bold.",
            "Learned from: objects, as in Table IX, or the other scenes of these data sets. AUROC: of failed against "
            "nominal; over the best gate: minus that of the best other gate (the alarms by a single number, RMSE, "
            "fitness and the like), on the same draws, so that it is better where the interval is above 0. False "
            "alarms: share of the nominal above the alarm that finds 90 % of the failed. State: mean share of the "
            "nominal and of the failed that is called so.",
            f"Cause: mean over the causes by which {FEWEST_OF_A_CAUSE} or more failed of the share whose cause has the "
            "largest score; who names no cause has none. Regret: as in Table IX.",
            COST_NOTE,
        ),
    )


def table18_scan_counts(measured: pd.DataFrame, scans: Mapping[str, str]) -> Table:
    """Return what became of registrations by data set, kind of start or noise added, and overlap.

    Args:
        measured, scans: as for :func:`table18_scan_causes`.
    """
    table = TableBuilder("table18_scan_counts", {"scans": "Scans", "start": "Start", "overlap": "Overlap"})
    conditions = STARTS | {
        name: f"{name.removeprefix(ADDED + '_')} times the sensor's noise added"
        for name in sorted(set(measured["condition"]))
        if name.startswith(f"{ADDED}_")
    }
    of_truth = rows_where(measured, method=TRUTH)
    strata = sorted(set(of_truth["stratum"]) - {EVERY})
    titles = {POOLED: "All together", **scans}
    for name, title in titles.items():
        for condition, words in conditions.items():
            for stratum in (EVERY, *strata) if condition in STARTS else (EVERY,):
                if of := counted(measured, name, condition, stratum):
                    of = of | {"failed": failed(of)}
                    cells = {key: plain_cell(of[key], 1, of["registrations"]) for key in COUNTS}
                    labels = [(name, title), (condition, words), (stratum, stratum_in_words(stratum))]
                    table.add_row(labels, cells)
    return table.build(
        caption="What became of registrations of scans to scans, and by which cause they failed",
        column_head="count",
        columns={name: Column(title, 0, False, (0.0, inf)) for name, title in COUNTS.items()},
        footnotes=(
            "By a cause: it adds most to the error. Without a cause: off even when started from the truth and cropped "
            "to what both scans see; not among the failed. Noise is a cause only where it was added.",
            "No correspondence: ICP found none from any start around this one, and so did not move. These count by "
            "their state like all others.",
        ),
    )


def counted(measured: pd.DataFrame, source: str, condition: str, stratum: str) -> dict[str, int]:
    """Return the counts of registrations, by name; none where there are none."""
    rows = rows_where(measured, source=source, condition=condition, stratum=stratum, method=TRUTH)
    named = zip(rows["metric"], rows["value"], strict=True)
    return {metric.removeprefix("count_"): int(value) for metric, value in named}


def failed(counts: Mapping[str, int]) -> int:
    """Return how many failed by a cause."""
    return sum(counts[concept] for concept in CONCEPTS)


def stratum_in_words(stratum: str) -> str:
    """Return e.g. ``0.1 to 0.3`` for ``overlap_0.1_0.3``."""
    return "all" if stratum == EVERY else " to ".join(stratum.split("_")[1:])


def in_words(title: str, counts: Mapping[str, int]) -> str:
    """Return the sentence that counts the registrations of a data set."""
    by_cause = ", ".join(f"{counts[concept]} by {concept}" for concept in CONCEPTS if counts[concept])
    return (
        f"{title}: {plural(counts['registrations'], 'registration')} of {plural(counts['pairs'], 'pair')} in "
        f"{plural(counts['clusters'], 'scene')}; {counts[NOMINAL]} nominal, {counts[BORDERLINE]} borderline, "
        f"{counts[GEOMETRY]} off without a cause, {failed(counts)} failed{': ' if by_cause else ''}{by_cause}."
    )


def _cells(rows: pd.DataFrame, cost: Mapping) -> dict[str, Cell | None]:
    cells: dict[str, Cell | None] = {}
    for metric in (name for name in COLUMNS if name in rows.index):
        row = rows.loc[metric]
        cells[metric] = interval_cell(row, factor=1 if metric in FRACTION else 100)
        if metric == "auroc_failed" and isfinite(row["difference"]) and not str(row["method"]).startswith(GATE):
            cells[LEAD] = interval_cell(row, "difference", ("difference_low", "difference_high"), 1)
    if SAMPLES in rows.index:
        judged, seeds = int(rows.loc[SAMPLES, "value"]), int(rows.loc[SAMPLES, "seeds"])
        cells["samples"] = plain_cell(judged, seeds, judged)
        if cost["icp_calls"] is not None:
            cells["icp_calls"] = plain_cell(cost["icp_calls"], seeds, judged)
    return cells
