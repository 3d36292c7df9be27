"""Tables and the figure of the causes on scans: who detects failed registrations, names their causes, and counts."""

from collections.abc import Mapping
from itertools import product
from math import isfinite, nan

import numpy as np

from gpca.causes.judged import CEILING
from gpca.causes.scans import GLOBAL, LADDER
from gpca.causes.settings import OBJECTS, SCANS
from gpca.causes.truth import BORDERLINE, GEOMETRY, NOMINAL
from gpca.declarations import Run, figure, table
from gpca.errors import InputError
from gpca.evaluation.intervals import FEWEST_CLUSTERS, FEWEST_FAILURES, REPEATS
from gpca.evaluation.measures import POOLED
from gpca.experiments import cause_tables as tables
from gpca.experiments import scan_causes as scans
from gpca.experiments.diagnosis import cause_costs
from gpca.experiments.frame_causes import ENDS, MISSED_NOTE, counts_in, sheet_of_counts
from gpca.experiments.scan_causes import ADDED, CAUSES, EVERY, NATURAL, TRUTH
from gpca.experiments.scans import titles_of_scans
from gpca.explainers.registry import CAUSES as CAUSE_EXPLAINERS
from gpca.explainers.registry import explainer_entry
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures.panels import in_lines, legend_below, panels
from gpca.reporting.figures.style import CONCEPT_COLORS, GRAY, LIGHT_GRAY, SKY_BLUE, SMALL_PT, TEXT_WIDTH_IN
from gpca.reporting.sheet import Column, Row, Sheet, crossed, interval_cell, plain_cell, plural, show, where

MEASURED = {"measured": (scans.read_scan_causes, "scan_causes.csv")}
LEARNED = {OBJECTS: "objects", SCANS: "other scenes", "": "–"}
LEAD = "lead"
COLUMNS = {
    "auroc_failed": tables.SHOWN["auroc_failed"],
    LEAD: Column("AUROC over trivial", decimals=3, limits=(-1.0, 1.0)),
    "false_alarm_rate": tables.SHOWN["false_alarm_rate"],
    "state_accuracy": show("state_accuracy", "State (%)"),
    CAUSES: show(CAUSES, "Cause, balanced (%)"),
    **{key: tables.SHOWN[key] for key in ("regret", "icp_calls", "samples")},
}
NOT_COMPARED = (LEAD, "icp_calls", "samples")
TOGETHER = {POOLED: "All together"}
ON_LADDER, BY_METHOD = f"{NATURAL}_{LADDER}", f"{NATURAL}_{GLOBAL}"
STARTS = {NATURAL: "Natural: all starts", ON_LADDER: "Natural: ladder of errors", BY_METHOD: "Natural: global method"}
PANELS = {ON_LADDER: "started on the ladder", BY_METHOD: "started by a global method"}
PARTS = {  # what became of a registration -> label, color
    NOMINAL: ("nominal", SKY_BLUE),
    BORDERLINE: ("borderline", LIGHT_GRAY),
    GEOMETRY: ("without a cause", GRAY),
    **{concept: (f"failed by {concept}", CONCEPT_COLORS[concept]) for concept in CONCEPTS},
}
ROW_IN = 0.30


@table(
    tables.SECTION,
    "Table XVIII: causes on scans",
    """Registrations of scans to scans by ICP, from disturbed true poses and from the results of a global method. What
    made them fail is measured by counterfactuals.""",
    **MEASURED,
)
def table18_scan_causes(run: Run, measured):
    names = run.config["scan_causes"]["explainers"]
    costs = cause_costs(run.config, names, scans.reenactment_settings(run.config)) | tables.COSTS
    explainers = {name: explainer_entry(name, CAUSE_EXPLAINERS).title for name in names} | tables.AGAIN
    rows, counted = [], []
    for name, title in (TOGETHER | titles_of_scans(run.config)).items():
        if not (of := counts_of(measured, name, NATURAL, EVERY)):
            continue
        enough = min(of["failed"], of[NOMINAL]) >= FEWEST_FAILURES
        few = "" if enough else ": too few"
        data = (name, f"{title} ({of['failed']} failed, {of[NOMINAL]} nominal{few})")
        natural = {"source": name, "condition": NATURAL, "stratum": EVERY}
        for explainer, learned in product(explainers.items(), LEARNED.items()):
            labels = [data, explainer, learned, (costs[explainer[0]]["sees"],) * 2]
            place = natural | {"method": explainer[0], "learned": learned[0]}
            rows.append(Row(labels, place, rival=enough and explainer[0] != CEILING))
        by_cause = ", ".join(f"{of[concept]} by {concept}" for concept in CONCEPTS if of[concept])
        counted.append(
            f"{title}: {plural(of['registrations'], 'registration')} of {plural(of['pairs'], 'pair')} in "
            f"{plural(of['clusters'], 'scene')}; {of[NOMINAL]} nominal, {of[BORDERLINE]} borderline, "
            f"{of[GEOMETRY]} off without a cause, {of['failed']} failed{': ' if by_cause else ''}{by_cause}."
        )

    def more(row: Row, subset):
        rows, method = subset.set_index("metric"), row.where["method"]
        cells = {}
        if isfinite(rows["difference"].get("auroc_failed", nan)) and not scans.is_trivial(method):
            bounds = "difference_low", "difference_high"
            cells[LEAD] = interval_cell(rows.loc["auroc_failed"], "difference", bounds, 1)
        if scans.SAMPLES in rows.index:
            judged, seeds = (int(rows.loc[scans.SAMPLES, name]) for name in ("value", "seeds"))
            cells["samples"] = plain_cell(judged, seeds, judged)
            if (calls := costs.get(method, {}).get("icp_calls")) is not None:
                cells["icp_calls"] = plain_cell(calls, seeds, judged)
        return cells

    heads = {"scans": "Scans", "explainer": "Explainer", "learned": "Learned from", "reads": "Reads"}
    sheet = Sheet("table18_scan_causes", heads, rows, COLUMNS, measured, more=more)
    notes = (
        *counted,
        f"n: registrations that are nominal or failed, over {plural(sheet.seeds, 'seed')}. In brackets: the "
        f"95 % interval of {REPEATS} bootstrap draws over scenes. Too few: below {FEWEST_FAILURES} failed or "
        "nominal ones nothing is concluded, and no row is bold.",
        "Learned from: objects, as in Table IX, or the other scenes of these data sets. AUROC over trivial: minus that "
        "of the best other gate (an alarm by a single number) or trivial row, on the same draws. False alarms: share "
        "of the nominal above the alarm that finds 90 % of the failed. State: mean share of nominal and failed that is "
        "called so.",
        f"Cause: mean over the causes by which {scans.FEWEST_OF_A_CAUSE} or more failed of the share whose cause has "
        "the largest score; who names no cause has none. Regret: as in Table IX.",
        tables.COST_NOTE,
    )
    caption = "Who tells failed registrations of scans to scans, and names their causes, with nothing added to them"
    bold = [key for key in COLUMNS if key not in NOT_COMPARED]
    return sheet.table(caption, "metric", notes, bold=bold, same=1, keep_empty=True)


@table(
    tables.SECTION,
    "What became of registrations of scans",
    """How many registrations of each data set, kind of start and overlap ended where they should, and by which cause
    the others failed.""",
    **MEASURED,
)
def table18_scan_counts(run: Run, measured):
    added = sorted(name for name in set(measured["condition"]) if name.startswith(f"{ADDED}_"))
    conditions = STARTS | {name: f"{name.removeprefix(ADDED + '_')} times the sensor's noise added" for name in added}
    strata = {stratum: stratum_in_words(stratum) for stratum in (EVERY, *strata_of(measured))}
    axes = {"source": TOGETHER | titles_of_scans(run.config), "condition": conditions, "stratum": strata}
    rows = [row for row in crossed(*axes.items()) if row.where["condition"] in STARTS or row.where["stratum"] == EVERY]
    heads = {"scans": "Scans", "start": "Start", "overlap": "Overlap"}
    titles = {"registrations": "Registrations", "pairs": "Pairs", "clusters": "Scenes"} | ENDS
    notes = (
        *filter(None, (shares_in_words(measured, *named) for named in titles_of_scans(run.config).items())),
        "By a cause: it adds most to the error. Without a cause: off even when started from the truth and cropped "
        "to what both scans see; not among the failed. Noise is a cause only where it was added.",
        MISSED_NOTE,
    )
    caption = "What became of registrations of scans to scans, and by which cause they failed"
    return sheet_of_counts("table18_scan_counts", heads, rows, titles, measured).table(caption, "count", notes)


SHARES_IN_WORDS = {
    "share": "as drawn",
    "share_weighted": "as the data set's pairs overlap",
    "share_one_sided": "the same with only the source cropped, where overlap is made whole",
}


def shares_in_words(measured, name: str, title: str) -> str:
    """Sentence on the causes of failures from a global method's starts; nothing is concluded from few."""
    rows = where(measured, {"source": name, "condition": BY_METHOD, "method": scans.FAILED}).set_index("metric")
    if not len(rows):
        return ""
    count, clusters = (int(rows[column].iloc[0]) for column in ("samples", "clusters"))
    counted = f"{title}, from the global method's pose: {plural(count, 'failure')} in {plural(clusters, 'scene')}"
    if count < FEWEST_FAILURES or clusters < FEWEST_CLUSTERS:
        return f"{counted}: too few to conclude from."
    shares = []
    for kind, words in SHARES_IN_WORDS.items():
        share, low, high = 100 * rows.loc[f"{kind}_overlap", ["value", "low", "high"]]
        shares.append(f"{words} {share:.0f} % ({low:.0f} to {high:.0f})")
    return f"{counted}; by missing overlap {'; '.join(shares)}."


@figure(
    tables.SECTION,
    "By which cause registrations of scans fail",
    """Natural registrations, to which no noise was added, by how much the scans overlap. Numbers are counts.""",
    **MEASURED,
)
def scan_failures(run: Run, measured):
    from matplotlib.patches import Patch

    titles, strata = titles_of_scans(run.config), strata_of(measured)
    counted = {key: counts_of(measured, *key) for key in product(titles, PANELS, (EVERY, *strata))}
    lines = [name for name in titles if any(counted[name, condition, EVERY] for condition in PANELS)]
    columns = [condition for condition in PANELS if any(counted[name, condition, EVERY] for name in titles)]
    if not lines:
        raise InputError("causes of scans", "has no natural registrations of these data sets", "run them first")
    height_in = 0.9 + len(lines) * (0.45 + ROW_IN * len(strata))
    drawn, grid = panels(len(lines), len(columns), height_in, TEXT_WIDTH_IN, sharex=True, sharey=True)
    parts = {part: look for part, look in PARTS.items() if any(of.get(part) for of in counted.values())}
    for (line, column), panel in np.ndenumerate(grid):
        name, condition = lines[line], columns[column]
        panel.set_title(in_lines(f"{titles[name]}, {PANELS[condition]}", 48), fontsize=SMALL_PT)
        for place, stratum in enumerate(strata):
            left, of = 0.0, counted[name, condition, stratum]
            for part, (_, color) in parts.items() if of else ():
                share = 100 * of[part] / of["registrations"]
                panel.barh(place, share, left=left, color=color, height=0.75, linewidth=0)
                if share >= 6:
                    look = {"ha": "center", "va": "center", "fontsize": SMALL_PT}
                    look["color"] = "white" if color == GRAY else "black"
                    panel.text(left + share / 2, place, str(of[part]), **look)
                left += share
            if of:
                panel.text(102, place, f"$n$ = {of['registrations']}", va="center", color=GRAY, fontsize=SMALL_PT)
        panel.set_yticks(range(len(strata)), [stratum_in_words(stratum) for stratum in strata])
        panel.set(xlim=(0, 122), xticks=range(0, 101, 25))  # behind the bars stands how many registrations they are of
        panel.tick_params(labelsize=SMALL_PT)
    for panel in grid[:, 0]:
        panel.set_ylabel("overlap", fontsize=SMALL_PT)
    for panel in grid[-1]:
        panel.set_xlabel("registrations (%)", fontsize=SMALL_PT)
    handles = [Patch(color=color, label=label) for label, color in parts.values()]
    legend_below(drawn, handles, columns=3, fontsize=SMALL_PT)
    return drawn


def counts_of(measured, source: str, condition: str, stratum: str) -> Mapping[str, int]:
    """Counts of registrations by name; empty where there are none."""
    place = {"source": source, "condition": condition, "stratum": stratum, "method": TRUTH}
    return counts_in(where(measured, place))


def strata_of(measured) -> list[str]:
    return sorted(set(where(measured, {"method": TRUTH})["stratum"]) - {EVERY})


def stratum_in_words(stratum: str) -> str:
    """E.g. ``0.1 to 0.3`` for ``overlap_0.1_0.3``."""
    return "all" if stratum == EVERY else " to ".join(stratum.split("_")[1:])
