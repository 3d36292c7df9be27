"""Tables and the figure of the causes on scans: who detects failed registrations, names their causes, and counts."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.causes.judged import CEILING
from gpca.causes.scans import GLOBAL, LADDER
from gpca.causes.settings import OBJECTS, SCANS, DescriptorSettings
from gpca.causes.truth import BORDERLINE, GEOMETRY, NOMINAL
from gpca.errors import InputError
from gpca.evaluation.intervals import REPEATS
from gpca.evaluation.measures import POOLED
from gpca.experiments.cause_tables import AGAIN, COST_NOTE, COSTS, SHOWN, reads
from gpca.experiments.frame_causes import FEWEST_FAILURES
from gpca.experiments.plan import Run, plain
from gpca.experiments.result import figure, table
from gpca.experiments.scan_causes import (
    ADDED,
    CAUSES,
    EVERY,
    FEWEST_OF_A_CAUSE,
    GATE,
    NATURAL,
    SAMPLES,
    TRUTH,
    read_scan_causes,
    reenactment_settings,
)
from gpca.experiments.scans import titles_of_scans
from gpca.explainers.interface import icp_calls
from gpca.explainers.registry import CAUSES as CAUSE_EXPLAINERS
from gpca.explainers.registry import explainer_entry
from gpca.pairs.perturbation import CONCEPTS
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reporting.figures.panels import in_lines, legend_below, panels
from gpca.reporting.figures.style import CONCEPT_COLORS, GRAY, LIGHT_GRAY, SKY_BLUE, SMALL_PT, TEXT_WIDTH_IN
from gpca.reporting.tables.builder import TableBuilder
from gpca.reporting.tables.cells import interval_cell, plain_cell, rows_where
from gpca.reporting.tables.table import Cell, Column
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

SECTION = "Beyond the paper: what made a registration fail"
MEASURED = {"measured": (read_scan_causes, "scan_causes.csv")}
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
PANELS = {f"{NATURAL}_{LADDER}": "started on the ladder", f"{NATURAL}_{GLOBAL}": "started by a global method"}
PARTS = {  # what became of a registration -> label, color
    NOMINAL: ("nominal", SKY_BLUE),
    BORDERLINE: ("borderline", LIGHT_GRAY),
    GEOMETRY: ("without a cause", GRAY),
    **{concept: (f"failed by {concept}", CONCEPT_COLORS[concept]) for concept in CONCEPTS},
}
ROW_IN = 0.30


def costs_of(config: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """What each explainer sees, and the runs of ICP that it needs."""
    starts = config["causes"]["starts"]
    descriptors = DescriptorSettings(**plain(config["diagnosis"]["descriptors"]))
    reenactment = ReenactmentSettings(**plain(reenactment_settings(config))).calls(starts)
    entries = {name: explainer_entry(name, CAUSE_EXPLAINERS) for name in config["scan_causes"]["explainers"]}
    return {
        name: {"sees": entry.sight, "icp_calls": icp_calls(entry.sees, starts, descriptors, reenactment)}
        for name, entry in entries.items()
    }


@table(
    SECTION,
    "Table XVIII: causes on scans",
    """Registrations of scans to scans by ICP, from disturbed true poses and from the results of a global method. What
    made them fail is measured by counterfactuals: started from the truth, cropped to what both scans see, with
    more noise. Explainers have learned from objects, or from other scenes.""",
    **MEASURED,
)
def table18_scan_causes(run: Run, measured):
    """How well explainers detect natural failures of scans, and name their causes: data sets × explainers."""
    costs = {**costs_of(run.config), **COSTS}
    named = run.config["scan_causes"]["explainers"]
    explainers = {name: explainer_entry(name, CAUSE_EXPLAINERS).title for name in named}
    titles = {POOLED: "All together", **titles_of_scans(run.config)}
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


@table(
    SECTION,
    "What became of registrations of scans",
    """How many registrations of each data set, kind of start and overlap ended where they should, and by which cause
    the others failed.""",
    **MEASURED,
)
def table18_scan_counts(run: Run, measured):
    """Numbers of registrations by state and cause: data sets × kinds of start, or noise added × overlap."""
    table = TableBuilder("table18_scan_counts", {"scans": "Scans", "start": "Start", "overlap": "Overlap"})
    conditions = STARTS | {
        name: f"{name.removeprefix(ADDED + '_')} times the sensor's noise added"
        for name in sorted(set(measured["condition"]))
        if name.startswith(f"{ADDED}_")
    }
    of_truth = rows_where(measured, method=TRUTH)
    strata = sorted(set(of_truth["stratum"]) - {EVERY})
    titles = {POOLED: "All together", **titles_of_scans(run.config)}
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


@figure(
    SECTION,
    "By which cause registrations of scans fail",
    """Natural registrations, to which no noise was added, by how much the scans overlap. Numbers are counts.""",
    **MEASURED,
)
def scan_failures(run: Run, measured):
    """A panel for each data set and kind of start, in it a bar for each stratum of overlap, with its numbers."""
    scans = titles_of_scans(run.config)
    of_truth = rows_where(measured, method=TRUTH)
    strata = sorted(set(of_truth["stratum"]) - {EVERY})
    shown = [
        (name, condition)
        for name in scans
        for condition in PANELS
        if len(rows_where(of_truth, source=name, condition=condition))
    ]
    if not shown:
        raise InputError("causes of scans", "has no natural registrations of these data sets", "run them first")
    columns = len({condition for _, condition in shown})
    lines = [name for name in scans if any(name == of for of, _ in shown)]
    height_in = 0.9 + len(lines) * (0.45 + ROW_IN * len(strata))
    drawn, grid = panels(len(lines), columns, height_in, TEXT_WIDTH_IN, sharex=True, sharey=True)
    conditions = [condition for condition in PANELS if any(condition == of for _, of in shown)]
    parts = [part for part in PARTS if _is_there(measured, shown, strata, part)]
    for (line, column), panel in np.ndenumerate(grid):
        name, condition = lines[line], conditions[column]
        panel.set_title(in_lines(f"{scans[name]}, {PANELS[condition]}", 48), fontsize=SMALL_PT)
        for place, stratum in enumerate(strata):
            of = counted(measured, name, condition, stratum)
            if of:
                _draw_bar(panel, place, of, parts)
        panel.set_yticks(range(len(strata)), [stratum_in_words(stratum) for stratum in strata])
        panel.set_xlim(0, 100)
        panel.tick_params(labelsize=SMALL_PT)
    for panel in grid[:, 0]:
        panel.set_ylabel("overlap", fontsize=SMALL_PT)
    for panel in grid[-1]:
        panel.set_xlabel("registrations (%)", fontsize=SMALL_PT)
    legend_below(drawn, _handles(parts), columns=3, fontsize=SMALL_PT)
    return drawn


def _is_there(measured: pd.DataFrame, shown: list[tuple[str, str]], strata: list[str], part: str) -> bool:
    return any(counted(measured, *place, stratum).get(part, 0) for place in shown for stratum in strata)


def _draw_bar(panel, place: int, counts: Mapping[str, int], parts: list[str]) -> None:
    left, whole = 0.0, counts["registrations"]
    for part in parts:
        share = 100 * counts[part] / whole
        panel.barh(place, share, left=left, color=PARTS[part][1], height=0.75, linewidth=0)
        if share >= 6:
            color = "white" if PARTS[part][1] == GRAY else "black"
            look = {"ha": "center", "va": "center", "fontsize": SMALL_PT, "color": color}
            panel.text(left + share / 2, place, str(counts[part]), **look)
        left += share


def _handles(parts: list[str]) -> list:
    from matplotlib.patches import Patch

    return [Patch(color=color, label=label) for label, color in (PARTS[part] for part in parts)]


def counted(measured: pd.DataFrame, source: str, condition: str, stratum: str) -> dict[str, int]:
    """Counts of registrations by name; empty where there are none."""
    rows = rows_where(measured, source=source, condition=condition, stratum=stratum, method=TRUTH)
    named = zip(rows["metric"], rows["value"], strict=True)
    return {metric.removeprefix("count_"): int(value) for metric, value in named}


def failed(counts: Mapping[str, int]) -> int:
    """Number that failed by a cause."""
    return sum(counts[concept] for concept in CONCEPTS)


def stratum_in_words(stratum: str) -> str:
    """E.g. ``0.1 to 0.3`` for ``overlap_0.1_0.3``."""
    return "all" if stratum == EVERY else " to ".join(stratum.split("_")[1:])


def in_words(title: str, counts: Mapping[str, int]) -> str:
    """Sentence that counts the registrations of a data set."""
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
