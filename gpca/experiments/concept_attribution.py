"""How often each explainer names the concept that was perturbed, and at what cost (Tables I and II)."""

from collections.abc import Iterable
from dataclasses import replace
from math import inf
from pathlib import Path

import numpy as np

from gpca.attribution.predictions import concepts_of, read_predictions
from gpca.declarations import Experiment, Frame, Paths, Run, Tidy, table
from gpca.evaluation.measures import ALL, Clustered, Measure, by_value, over_seeds, read_all_metrics, read_samples
from gpca.explainers.gpca import GPCA_FORMS
from gpca.explainers.registry import explainer_entry
from gpca.reporting.sheet import Cell, Column, Row, Sheet, crossed, over_clusters, show, where, with_label
from gpca.reporting.tables.cells import cell_of_repeats
from gpca.reporting.words import span

PREDICTIONS = "predictions/{source}/{explainer}/seed{seed}.csv"
PREDICTED = {"prediction_files": PREDICTIONS}
TIMINGS = {"timing_files": "timings/{source}/{explainer}/seed{seed}.csv"}
EXPERIMENT = Experiment(
    name="concept_attribution",
    tidy=(
        Tidy("metrics.csv", "gpca.attribution.metrics:collect", PREDICTED),
        Tidy("attribution_intervals.csv", "gpca.experiments.concept_attribution:collect_intervals", PREDICTED),
        Tidy("timings.csv", "gpca.attribution.metrics:collect_timings", TIMINGS),
    ),
)


def collect_intervals(prediction_files: Paths) -> Frame:
    """Accuracies of `metrics.csv` over all seeds, with intervals; an abstained sample is wrong."""
    import pandas as pd

    def read(path: Path) -> Frame:
        return read_predictions(path).query("split == 'test'")

    def by_concept(rows: Frame) -> dict[str, np.ndarray]:
        return by_value(rows, "concept_true", concepts_of(rows))

    right = Measure(lambda rows: (rows["concept_true"] == rows["concept_predicted"]) & ~rows["abstained"])
    frames = []
    samples = read_samples(prediction_files, read).assign(table="attribution")
    for (source, _), rows in samples.groupby(["source", "method"], sort=False):
        draws = Clustered.drawn(rows["seed"], rows["cluster"], "attribution intervals", source)
        frames.append(over_seeds(rows.reset_index(drop=True), by_concept, {"accuracy": right}, draws))
    return pd.concat(frames, ignore_index=True)


SECTION = "IV-B Concept attribution accuracy"
EXTENDED = {
    "accuracy": show("accuracy", "Accuracy (%)"),
    "abstention_rate": Column("Abstained (%)", interval=False),
    "icp_calls": Column("ICP calls", decimals=0, interval=False, limits=(0, inf)),
    "seconds_per_sample": Column("Seconds", decimals=3, interval=False, limits=(0, inf)),
    "test_samples": Column("n", decimals=0, interval=False, limits=(0, inf)),
}


@table(
    SECTION,
    "Table I: accuracy of SHAP, SA and GP-CA",
    """Table I of the paper: how often SHAP, sensitivity analysis (SA) and GP-CA name the one concept that was
    perturbed. Guessing is right in a third of the cases. GP-CA stands as the paper sets it and trained longer.""",
    paper=True,
    only={"explainer": ("shap_additive", "sa_local_additive", *GPCA_FORMS)},
    intervals=(collect_intervals, PREDICTIONS),
)
def table1_single_baselines(run: Run, intervals):
    explainers = titles(run)
    columns = {name: show("accuracy", title, where={"method": name}) for name, title in explainers.items()}
    axis = ("source", run.source_titles)
    sheet = Sheet("table1_single_baselines", {"source": "Dataset"}, crossed(axis), columns, intervals)
    groups: dict[str, list[str]] = {}  # test samples of a seed -> titles of the explainers
    for name in intervals["method"].unique():
        if counts := [cell.test_samples // cell.seeds for (_, key), cell in sheet.cells.items() if key == name]:
            groups.setdefault(span(counts), []).append(explainers[name])
    explained = "; ".join(f"{samples} by {', '.join(names)}" for samples, names in groups.items())
    notes = [f"Test samples explained: {explained}."] if len(groups) > 1 else []
    notes = [repeats(sheet.cells.values()), *notes, "Abstained samples count as wrong."]
    caption = "Mean accuracy of single-concept attribution (%)" + run.stand_ins()
    return sheet.table(caption, "explainer", notes, bold_across=columns)


@table(
    SECTION,
    "Table II: accuracy per concept",
    """Table II of the paper: GP-CA's accuracy on the samples of each concept. The confusions below show what a missed
    concept is taken for.""",
    paper=True,
    only={"explainer": GPCA_FORMS},
    intervals=(collect_intervals, PREDICTIONS),
)
def table2_per_concept(run: Run, intervals):
    concepts = [concept for concept in intervals["concept"].unique() if concept != ALL]
    columns = {concept: show("accuracy", concept.capitalize(), concept) for concept in (*concepts, ALL)}
    rows = crossed(("source", run.source_titles), ("method", titles(run)))
    sheet = Sheet("table2_per_concept", {"source": "Dataset", "explainer": "Explainer"}, rows, columns, intervals)
    notes = [
        repeats(cell for (_, key), cell in sheet.cells.items() if key == ALL),
        "Of the test samples that truly are of a concept, the share that is attributed to it.",
    ]
    caption = "Mean accuracy per concept (%)" + run.stand_ins()
    return sheet.table(caption, "concept", notes, bold_across=concepts)


@table(
    SECTION,
    "Table I, extended: every explainer",
    """Every explainer of this suite, including the paper's three, on the same test samples, with its cost. Oracles are
    given what the others have to infer, so they bound their family from above.""",
    intervals="attribution_intervals.csv",
    metrics=(read_all_metrics, ("metrics.csv", "timings.csv")),
)
def table1_extended(run: Run, intervals, metrics):
    entries = {name: explainer_entry(name) for name in run.section("explainers")}

    def more(row: Row, _subset: Frame) -> dict[str, Cell | None]:
        of_metric = where(metrics, {**row.where, "concept": ALL}).groupby("metric")["value"]
        values = {
            metric: value_R.to_numpy() * (100 if metric == "abstention_rate" else 1) for metric, value_R in of_metric
        }
        shown = [metric for metric in EXTENDED if metric in values and metric != "accuracy"]
        return {metric: cell_of_repeats(values[metric], int(values["test_samples"].sum())) for metric in shown}

    rows = crossed(("source", run.source_titles), ("method", titles(run)))
    rows = with_label(rows, lambda row: entries[row.where["method"]].sight)
    rows = [replace(row, rival=not entries[row.where["method"]].oracle) for row in rows]
    heads = {"source": "Dataset", "explainer": "Explainer", "reads": "Reads"}
    sheet = Sheet("table1_extended", heads, rows, EXTENDED, intervals, more=more)
    footnotes = (
        repeats(cell for (_, key), cell in sheet.cells.items() if key == "accuracy"),
        "Bold: best accuracy on the dataset, oracles apart. Abstained samples are wrong. Reads: what an explainer sees "
        "of a registration.",
        "ICP calls: ICP runs per sample beyond the observed registration. Seconds: all that one sample takes, that "
        "registration included; the one column that differs from run to run. n: test samples of a seed; fewer where "
        "each takes hundreds of ICP calls (uncertainty.*.samples, config).",
    )
    caption = "Single-concept attribution by every explainer" + run.stand_ins()
    return sheet.table(caption, "metric", footnotes, bold=["accuracy"], same=1)


def titles(run: Run) -> dict[str, str]:
    return run.titles(explainer_entry, run.section("explainers"))


def repeats(cells: Iterable[Cell]) -> str:
    """Footnote on seeds and test samples, which may differ from cell to cell."""
    cells = list(cells)
    samples = span(cell.test_samples // cell.seeds for cell in cells)
    return f"{over_clusters(span(cell.seeds for cell in cells), samples)}."
