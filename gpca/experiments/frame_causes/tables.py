"""Makes Table IX on depth frames: what started where, what became of it, and what explainers say of that."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import TYPE_CHECKING

from gpca.causes.judged import CEILING
from gpca.causes.truth import BORDERLINE, GEOMETRY, NOMINAL
from gpca.evaluation.intervals import REPEATS
from gpca.experiments.diagnosis.tables import (
    AGAIN,
    COST_NOTE,
    COSTS,
    NOT_COMPARED,
    ROW_HEADS,
    SHOWN,
    cells_of,
    reads,
)
from gpca.experiments.frame_causes.metrics import PSEUDO, STATE, TRUTH
from gpca.frames.source import REAL_WORLD
from gpca.frames.starts import CARRIED, LADDER, NATIVE, TRANSPLANTED
from gpca.objects.entry import title_of
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.builder import TableBuilder, crossed
from gpca.reporting.tables.cells import plain_cell, rows_where
from gpca.reporting.tables.table import Column, Table
from gpca.reporting.words import dataset_in_words, plural

if TYPE_CHECKING:
    import pandas as pd

FEWEST_FAILURES = 30  # of a kind, below which nothing is concluded from it
STARTS = {
    NATIVE: "Estimated in the image",
    CARRIED: "Carried over from a neighboring image",
    TRANSPLANTED: "Errors made elsewhere",
    LADDER: "Ladder of errors",
    PSEUDO: "Truth made by ICP",
}
MEASURED = {
    STATE: Column("State (%)"),
    **{key: SHOWN[key] for key in ("gain", "lead", "regret", "tied_accuracy", "dominant_accuracy")},
    **{key: SHOWN[key] for key in ("false_alarm_rate", "auroc_failed", "average_precision", "spearman_attribution")},
    **{key: SHOWN[key] for key in ("nominal_calibration", "icp_calls", "samples")},
}


def table9_frames(
    intervals: pd.DataFrame, frames: Mapping, explainers: Mapping[str, str], costs: Mapping[str, Mapping]
) -> Table:
    """Return how explainers that learned from simulated causes name those measured in frames, by kind of start.

    Args:
        intervals: What :func:`gpca.experiments.frame_causes.metrics.collect` returned.
        frames: The ``{"title": str, "stand_in": bool}`` of the frames.
        costs: As for :func:`gpca.experiments.diagnosis.tables.table9_causes`.
    """
    costs = {**costs, **COSTS}
    counts = {kind: _counted(intervals, kind) for kind in STARTS if kind != PSEUDO}
    titles = {kind: _title(kind, of_kind) for kind, of_kind in counts.items() if of_kind}
    table = TableBuilder("table9_frames", {"start": "Starts", **ROW_HEADS})
    for (kind, explainer), labels in crossed(titles, {**explainers, **AGAIN}):
        rows = rows_where(intervals, source=f"{REAL_WORLD}/{kind}", method=explainer).set_index("metric")
        enough = _failed(counts[kind]) >= FEWEST_FAILURES
        cells = cells_of(rows, MEASURED, STATE, costs[explainer])
        table.add_row([*labels, reads(costs[explainer])], cells, rival=enough and explainer != CEILING)
    table.require_rows()
    table.compare_down([key for key in MEASURED if key not in NOT_COMPARED], same=1)
    return table.build(
        caption=f"What is wrong with registrations of depth frames: {title_of(frames)}; learned from simulated causes",
        column_head="metric",
        columns=MEASURED,
        footnotes=(
            *(_in_words(kind, counts[kind]) for kind in titles),
            f"Too few: below {FEWEST_FAILURES} failures nothing is concluded, and no row is bold. The same holds for "
            "each cause by itself.",
            "An instance counts once, whatever its number of starts. In brackets: the 95 % interval of "
            f"{REPEATS} bootstrap draws over scenes. Bold: best of these starts.",
            "State: mean share of the nominal and of the failed that is called so. Over untrained, lead: State minus "
            "that of the best untrained row and of the best other row, on the same draws. n: starts that are nominal "
            "or failed. The others as in Table IX. The rule counts points against the part of the model that the "
            "camera would see, which is not what it was made for: here it is a control. A re-enactment also reads "
            "the mesh, the camera and the pixels of the object.",
            COST_NOTE,
        ),
    )


def table9_frame_counts(intervals: pd.DataFrame, frames: Mapping) -> Table:
    """Return how many registrations of each kind of start are nominal, borderline and failed, and by which cause.

    Args:
        intervals, frames: as for :func:`table9_frames`.
    """
    shown = {"starts": "Starts", "instances": "Instances", "scenes": "Scenes", NOMINAL: "Nominal"}
    shown |= {BORDERLINE: "Borderline", "failed": "Failed"} | {name: f"By {name}" for name in CONCEPTS}
    shown |= {GEOMETRY: "Without a cause", "missed": "No correspondence"}
    table = TableBuilder("table9_frame_counts", {"start": "Starts", "dataset": "Dataset"})
    for kind, title in STARTS.items():
        stem = f"{REAL_WORLD}/{kind}"
        sources = intervals.loc[intervals["source"].str.startswith(f"{stem}/"), "source"].unique()
        datasets = [name.removeprefix(f"{stem}/") for name in sorted(sources)]
        words_of = {"": "All"} | {name: dataset_in_words(name) for name in datasets}
        for dataset, words in words_of.items():
            if of := _counted(intervals, f"{kind}/{dataset}".removesuffix("/")):
                counts = {**of, "failed": _failed(of)}
                cells = {name: plain_cell(counts[name], 1, of["starts"]) for name in shown}
                table.add_row([(kind, title), (dataset or "all", words)], cells)
    return table.build(
        caption=f"What became of registrations of depth frames: {title_of(frames)}",
        column_head="count",
        columns={name: Column(title, 0, False, (0.0, inf)) for name, title in shown.items()},
        footnotes=(
            "Every estimator's pose of an instance is a start by itself. By a cause: it adds most to the error, as "
            "Table IX measures it. Without a cause: off even with every cause removed; not among the failed.",
            "No correspondence: ICP found none from any start around this one, and so did not move. These count by "
            "their state like all others.",
            "Truth made by ICP: the true poses were found by ICP themselves, so these test no ICP and are counted here "
            "alone.",
        ),
    )


def _counted(intervals: pd.DataFrame, kind: str) -> dict[str, int]:
    """Return the counts of a kind of start, by name; none where there are no such starts."""
    rows = rows_where(intervals, source=f"{REAL_WORLD}/{kind}", method=TRUTH)
    named = zip(rows["metric"], rows["value"], strict=True)
    return {metric.removeprefix("count_"): int(value) for metric, value in named}


def _failed(counts: Mapping[str, int]) -> int:
    return sum(counts[concept] for concept in CONCEPTS)


def _title(kind: str, counts: Mapping[str, int]) -> str:
    failed = _failed(counts)
    few = ", too few" if failed < FEWEST_FAILURES else ""
    return f"{STARTS[kind]} ({failed} failed{few})"


def _in_words(kind: str, counts: Mapping[str, int]) -> str:
    """Return the sentence that counts the starts of a kind."""
    by_cause = ", ".join(f"{counts[concept]} mostly by {concept}" for concept in CONCEPTS)
    most, failed = max(counts[concept] for concept in CONCEPTS), _failed(counts)
    constant = f" One constant answer names {100 * most / failed:.0f} % of these." if failed else ""
    return (
        f"{STARTS[kind]}: {plural(counts['starts'], 'start')} of {plural(counts['instances'], 'instance')} in "
        f"{plural(counts['scenes'], 'scene')}; {counts[NOMINAL]} nominal, {counts[BORDERLINE]} borderline, "
        f"{counts[GEOMETRY]} off without a cause, {failed} failed: {by_cause}.{constant}"
    )
