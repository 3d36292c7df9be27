"""Tables IX and their figures: whether explainers say that a registration failed, and why, by the measured truth."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from math import inf
from typing import Any

from gpca.causes.judged import CEILING
from gpca.declarations import Frame, Run, figure, table
from gpca.evaluation.intervals import FEWEST_CLUSTERS, FEWEST_FAILURES, REPEATS
from gpca.evaluation.measures import POOLED
from gpca.experiments.confusions import draw_confusions
from gpca.experiments.diagnosis import JUDGED, TRAINED, cause_costs, cause_titles
from gpca.explainers.interface import WORDS
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.sheet import Cell, Column, Row, Sheet, crossed, show, where, with_label
from gpca.reporting.tables.cells import interval_cell, plain_cell, rows_where
from gpca.reporting.words import plural

NEAR = 10  # points above chance up to which the untrained rule is near it
SECTION = "Beyond the paper: what made a registration fail"
POINTS: dict[str, Any] = {"limits": (-100.0, 100.0)}
PLAIN: dict[str, Any] = {"factor": 1, "interval": False}
COUNTS: dict[str, Any] = {"decimals": 0, "interval": False, "limits": (0.0, inf)}
SHOWN = {
    "regret": show("regret", "Regret (%)", limits=(0.0, inf), least_is_best=True),
    "tied_accuracy": show("tied_accuracy", "With ties (%)"),
    "balanced_accuracy": show("balanced_accuracy", "Balanced (%)"),
    "gain": show("balanced_accuracy", "Over trivial (points)", where={"against": "trivial"}, **POINTS),
    "lead": show("balanced_accuracy", "Lead (points)", where={"against": "rival"}, **POINTS),
    "dominant_accuracy": show("dominant_accuracy", "Dominant (%), chance 33.3"),
    "false_alarm_rate": show("false_alarm_rate", "False alarms (%)", least_is_best=True),
    "auroc_failed": show("auroc_failed", "AUROC", factor=1, decimals=3, limits=(0.0, 1.0)),
    "average_precision": show("average_precision", "mAP (%)", interval=False),
    "spearman_attribution": show("spearman_attribution", "Spearman", decimals=2, limits=(-1.0, 1.0), **PLAIN),
    "nominal_calibration": show(
        "nominal_calibration", "ECE (share)", decimals=3, limits=(0.0, 1.0), least_is_best=True, **PLAIN
    ),
    "icp_calls": Column("ICP calls", **COUNTS),
    "samples": Column("n", **COUNTS),
}
NOT_COMPARED = ("gain", "lead", "icp_calls", "samples")
AGAIN = {CEILING: "Truth from other starts (counterfactual access)"}
COSTS: dict[str, dict[str, Any]] = {CEILING: {"sees": WORDS["truth"], "icp_calls": None}}
COST_NOTE = "Reads: what an explainer sees of a registration. ICP calls: runs beyond the one that it explains."


def counts_and_calls(costs: Mapping[str, Mapping]) -> Callable[[Row, Frame], dict[str, Cell]]:
    """The function that gives a row of a sheet its most samples, and the runs of ICP of its explainer."""

    def cells(row: Row, subset: Frame) -> dict[str, Cell]:
        judged, seeds = subset["samples"].max(), int(subset["seeds"].iloc[0])
        counts = {"samples": judged, "icp_calls": costs.get(row.where["method"], {}).get("icp_calls")}
        return {key: plain_cell(count, seeds, int(judged)) for key, count in counts.items() if count is not None}

    return cells


@table(
    SECTION,
    "Table IX: what is wrong, and why",
    """Every explainer on registrations whose true causes are measured: does it say whether anything is wrong, and which
    cause did most? Nothing was trained on a test object. The last row of a dataset is the truth measured again from
    other starts, which knows the true pose and the clean clouds, as no observer does.""",
    intervals="cause_intervals.csv",
)
def table9_causes(run: Run, intervals):
    explainers, titles = cause_titles(run.config), run.source_titles | {POOLED: "All together"}
    costs = cause_costs(run.config, explainers) | COSTS
    rows = with_label(
        crossed(("source", titles), ("method", explainers | AGAIN)), lambda row: costs[row.where["method"]]["sees"]
    )
    rows = [replace(row, rival=row.where["method"] != CEILING) for row in rows]
    states = {}
    for source, title in run.source_titles.items():
        samples = where(intervals, {"source": source}).groupby("metric")["samples"].max()
        if (nominal := samples.get("false_alarm_rate")) is not None:
            states[title] = f"{nominal:.0f} are nominal and {samples.max() - nominal:.0f} failed"
    alike = len(states) > 1 and len(set(states.values())) == 1
    counted = "; ".join(dict.fromkeys(f"{of} on {'each dataset' if alike else title}" for title, of in states.items()))
    heads = {"source": "Dataset", "explainer": "Explainer", "reads": "Reads"}
    sheet = Sheet("table9_causes", heads, rows, SHOWN, intervals, more=counts_and_calls(costs))
    notes = (
        *filter(None, [lead(intervals, explainers)]),
        f"n: test samples that are judged, over {plural(sheet.seeds, 'seed')}; borderline ones are left "
        f"out. Of them, {counted}. In brackets: the 95 % interval of a bootstrap over objects "
        f"and seeds ({REPEATS} draws). Bold: best explainer on a dataset.",
        "Regret: of the failed, the share of the error that removing the best single cause would take away and "
        "removing the named one does not; who names nominal removes nothing. With ties: as Dominant, but any cause "
        "counts whose φ is within the limit of a cause (1 % of the diameter by default) of the largest.",
        "Balanced: mean share named rightly of nominal and of the three dominant causes. Over trivial, lead: balanced "
        "accuracy minus that of the best trivial row (chance to density, and hypotheses with thresholds), and of the "
        "best other explainer, on the same draws. Dominant: of the failed alone, the share whose main cause has the "
        "highest score among the causes."
        + rule_near_chance(intervals, run.sources, metric="dominant_accuracy", against=""),
        "False alarms: share of the nominal above the alarm that finds 90 % of the failed. AUROC: of failed against "
        "nominal. mAP: mean average precision of the sets of causes. Spearman: of scores and measured attributions "
        "of the failed. ECE: expected calibration error of the score of nominal. Gates only say whether something is "
        "wrong.",
        COST_NOTE,
    )
    caption = "What is wrong with a registration, if anything: objects that no explainer was trained on"
    caption += run.stand_ins()
    bold = sorted((key for key in SHOWN if key not in NOT_COMPARED), key=lambda key: key != "balanced_accuracy")
    return sheet.table(caption, "metric", notes, bold=bold, same=1)


def lead(intervals: Frame, titles: Mapping[str, str]) -> str:
    """Sentence on the lead over all sources together, with titles of explainers; empty where no rows have it."""
    rows = rows_where(intervals, method=JUDGED, source=POOLED).set_index(["against", "metric"], drop=False)
    if (TRAINED, "balanced_accuracy") not in rows.index:
        return ""
    nominal, failed = rows.loc[""].loc[["false_alarm_rate", "dominant_accuracy"], "samples"]
    fewest = int(min(nominal, failed // len(CONCEPTS)))  # each dominant cause has a third of the failures
    row = rows.loc[(TRAINED, "balanced_accuracy")]
    if fewest < FEWEST_FAILURES or row["clusters"] < FEWEST_CLUSTERS:
        counted = f"{fewest} samples of a kind and {row['clusters']:.0f} families"
        return f"Too little to conclude who leads: {counted} (it takes {FEWEST_FAILURES} and {FEWEST_CLUSTERS})."
    title, other = (titles[row[name]] for name in ("method", "other"))
    best = f"{other}, the best explainer that is trained and reads no re-enactment"
    value, low, high = 100 * row[["value", "low", "high"]].astype(float)
    least, most = sorted((abs(low), abs(high)))
    points = f"{abs(value):.1f} points of balanced accuracy ({least:.1f} to {most:.1f})"
    if high < 0:
        return f"{best}, leads {title} by {points}."
    if low > 0:
        return f"{title} leads {best}, by {points}."
    return f"{title} is not shown to lead {best}: {value:+.1f} points of balanced accuracy ({low:.1f} to {high:.1f})."


def rule_near_chance(intervals: Frame, sources: Iterable[str], **wanted: object) -> str:
    """Sentence on the untrained rule's share, its distance from chance, and whether its interval ends near that.

    Of all sources together, or of the first that has the rule; `wanted` are further entries of the row.
    """
    rule, chance = rows_where(intervals, method="rule", **wanted), 100 / len(CONCEPTS)
    for source in (POOLED, *sources):
        rows = rows_where(rule, source=source)
        if len(rows) and (bounds := (cell := interval_cell(rows.iloc[0])).bounds):
            low, high = bounds
            ends = "ends within" if high <= chance + NEAR else "reaches beyond"
            return (
                f" There the untrained rule is right in {cell.mean:.1f} % ({low:.1f} to {high:.1f}), which is "
                f"{cell.mean - chance:+.1f} points from chance; the interval {ends} {NEAR} points above chance."
            )
    return ""


@table(
    SECTION,
    "Table IX by what is read",
    """A forest and GP-CA's classifier on more and more of a registration: the observed cloud alone, both clouds, how
    far ICP moved them, further runs from other starts, and runs with remedies, with the cost of each.""",
    intervals="feature_intervals.csv",
)
def table9_features(run: Run, intervals):
    titles, explainers = {POOLED: "All together"} | run.source_titles, cause_titles(run.config, "by_features")
    keys = ("icp_calls", "regret", "tied_accuracy", "balanced_accuracy", "lead", "dominant_accuracy")
    columns = {key: SHOWN[key] for key in (*keys, "false_alarm_rate", "auroc_failed", "samples")}
    columns["lead"] = replace(columns["lead"], title="To the best other (points)")
    rows = crossed(("source", titles), ("method", explainers))
    more = counts_and_calls(cause_costs(run.config, explainers))
    heads = {"source": "Dataset", "explainer": "Learner and what it reads"}
    sheet = Sheet("table9_features", heads, rows, columns, intervals, more=more)
    notes = (
        "ICP calls: runs beyond the one that is explained. Aligned source: thickness, spacing, extent and number of "
        "points of the observed cloud. Remedies with few calls: those without a restart.",
        "To the best other: balanced accuracy minus that of the best other row, on the same draws; others as in "
        f"Table IX. {sheet.over(clusters='objects')}. Bold: best of a dataset.",
    )
    caption = "What each part of a registration tells of its causes" + run.stand_ins()
    return sheet.table(caption, "metric", notes, bold=[key for key in columns if key not in NOT_COMPARED], same=1)


@figure(
    SECTION,
    "What a cause is taken for",
    """What GP-CA, its classifier on both clouds, and the re-enactment without and with learning take a nominal
    registration and each dominant cause for, pooled over sources and seeds, without borderline ones.""",
    metrics="causes.csv",
)
def cause_confusions(run: Run, metrics):
    return draw_confusions(metrics, cause_titles(run.config), COMPARED, ", ".join(run.source_titles.values()))


COMPARED = ("gpca", "gpca_pair", "reenact", "reenact_committee")  # the first of the figures
