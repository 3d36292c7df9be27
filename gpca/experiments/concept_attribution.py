"""How often each explainer names the concept that was perturbed, and at what cost (Tables I and II)."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import permutations
from math import inf

import numpy as np

from gpca.attribution.metrics import read_causal
from gpca.attribution.predictions import concepts_of, read_predictions
from gpca.declarations.experiment import Experiment, Tidy
from gpca.declarations.plan import Run
from gpca.declarations.result import Frame, Paths, table
from gpca.errors import InputError
from gpca.evaluation.intervals import Clustered, Estimate
from gpca.evaluation.measures import ALL, intervals, read_all_metrics, source_method_seed
from gpca.explainers.gpca import GPCA_FORMS
from gpca.explainers.registry import explainer_entry
from gpca.reporting.sheet import Row, Sheet, Show, crossed, show, where, with_label
from gpca.reporting.tables.builder import over_clusters
from gpca.reporting.tables.cells import cell_of_repeats
from gpca.reporting.tables.table import EMPTY, Cell, Column
from gpca.reporting.words import span

PREDICTIONS = "predictions/{source}/{explainer}/seed{seed}.csv"
PREDICTED = {"prediction_files": PREDICTIONS, "causal_files": "uncertainty/{source}/causal/seed{seed}.csv"}
TIMINGS = {"timing_files": "timings/{source}/{explainer}/seed{seed}.csv"}
EXPERIMENT = Experiment(
    name="concept_attribution",
    tidy=(
        Tidy("metrics.csv", "gpca.attribution.metrics:collect", PREDICTED),
        Tidy("attribution_intervals.csv", "gpca.experiments.concept_attribution:collect_intervals", PREDICTED),
        Tidy("timings.csv", "gpca.attribution.metrics:collect_timings", TIMINGS),
    ),
)


def collect_intervals(prediction_files: Paths, causal_files: Paths = ()) -> Frame:
    """Accuracies of `metrics.csv` over all seeds, with 95 % intervals (:mod:`gpca.evaluation.measures`).

    - accuracy: of all test samples and of each concept; an abstained sample is wrong.
    - permuted_accuracy: mean over the seeds of each one's accuracy under its best renaming of the concepts.
    - causal_accuracy: of the causal samples, where there are causal files.

    The draws of a source are the same for all explainers that explain the same samples.
    """
    import pandas as pd

    causal_paths = {source_method_seed(path)[::2]: path for path in causal_files}
    parts: dict[tuple[str, str], list[Frame]] = {}
    for path in prediction_files:
        source, method, seed = source_method_seed(path)
        rows = read_predictions(path)
        rows = rows[rows["split"] == "test"].assign(seed=seed)
        if rows.empty:
            raise InputError(path, "has no test rows", "regenerate it")
        if causal_path := causal_paths.get((source, seed)):
            causal, keys = read_causal(causal_path), pd.MultiIndex.from_frame(rows[["split", "sample"]])
            if not keys.isin(causal.index).all():
                raise InputError(causal_path, f"lacks samples of {path}", "regenerate both from the same config")
            rows["causal"] = causal[keys].to_numpy(bool)
        parts.setdefault((source, method), []).append(rows)
    records = []
    for (source, method), seeds in parts.items():
        rows = pd.concat(seeds, ignore_index=True)
        draws = Clustered.drawn(rows["seed"], rows["cluster"], "attribution intervals", source)
        for metric, concept, subset, estimate in _accuracies(rows, draws):
            records.append(subset.record(("attribution", source, method, metric, concept), estimate))
    return intervals(records, "predictions")


def _accuracies(rows: Frame, draws: Clustered) -> Iterator[tuple[str, str, Clustered, Estimate]]:
    """Yield metric, concept, the samples that it is over, and its estimate."""
    concepts = concepts_of(rows)
    true_N, named_N = (rows[name].to_numpy(str) for name in ("concept_true", "concept_predicted"))
    named_N = np.where(rows["abstained"], "", named_N)
    right_N = true_N == named_N
    is_true_C_N, is_named_C_N = (np.array([each_N == name for name in concepts]) for each_N in (true_N, named_N))

    def permuted(rows_n: np.ndarray, weights_B_n: np.ndarray) -> np.ndarray:
        hits_C_C_n, number = is_true_C_N[:, None, rows_n] & is_named_C_N[None, :, rows_n], range(len(concepts))
        renamings = [hits_C_C_n[number, list(order)].any(axis=0) for order in permutations(number)]
        best_B = np.max([(weights_B_n * hit_n).sum(axis=1) for hit_n in renamings], axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):  # a draw without any sample has no value
            return best_B / weights_B_n.sum(axis=1)

    yield "accuracy", ALL, draws, draws.share(right_N)
    for concept, mask_N in zip(concepts, is_true_C_N, strict=True):
        if mask_N.any():
            subset = draws.subset(mask_N)
            yield "accuracy", concept, subset, subset.share(right_N[mask_N])
    yield "permuted_accuracy", ALL, draws, draws.over_seeds(permuted, (0, 1))
    if "causal" in rows and (mask_N := rows["causal"].eq(True).to_numpy()).any():
        subset = draws.subset(mask_N)
        yield "causal_accuracy", ALL, subset, subset.share(right_N[mask_N])


SECTION = "IV-B Concept attribution accuracy"
LEAST_CAUSAL = 30  # causal samples of all seeds; the accuracy on fewer says nothing
EXTENDED = {
    "accuracy": show("accuracy", "Accuracy (%)"),
    "permuted_accuracy": show("permuted_accuracy", "Relabeled (%)"),
    "causal_accuracy": show("causal_accuracy", "Causal (%)"),
    "causal_samples": Column("n causal", decimals=0, interval=False, limits=(0, inf)),
    "abstention_rate": Column("Abstained (%)", interval=False),
    "icp_calls": Column("ICP calls", decimals=0, interval=False, limits=(0, inf)),
    "seconds_per_sample": Column("Seconds", decimals=3, interval=False, limits=(0, inf)),
    "test_samples": Column("n", decimals=0, interval=False, limits=(0, inf)),
}
NOTES = {
    "permuted_accuracy": (
        "Relabeled: accuracy under the best one-to-one renaming of the predicted concepts, which takes the truth "
        "to find; where it is far above the accuracy, concepts are separated but named wrongly."
    ),
    "causal_accuracy": (
        "Causal: accuracy on the n causal samples whose uncertainty lies above the 95th percentile of the clean "
        f"ones of their dataset and seed; {EMPTY} where there are fewer than {LEAST_CAUSAL} in all seeds."
    ),
    "icp_calls": "ICP calls: ICP runs per sample beyond the observed registration.",
    "seconds_per_sample": "Seconds: all that one sample takes, the observed registration included; "
    "the one column that differs from run to run.",
    "test_samples": "n: test samples of a seed; fewer where each takes hundreds of ICP calls "
    "(uncertainty.*.samples, config).",
}


@table(
    SECTION,
    "Table I: accuracy of SHAP, SA and GP-CA",
    """Table I of the paper: how often SHAP, sensitivity analysis (SA) and GP-CA name the one concept that was
    perturbed. Guessing is right in a third of the cases.

    GP-CA has two rows: the setting that the paper prints, which the comparison uses, and one trained longer.""",
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
    """Every explainer of this suite, including the paper's three, on the same test samples, with its cost.

    Oracles are given what the others have to infer, so they bound their family from above. If the relabeled accuracy
    is far above the accuracy, an explainer separates the concepts but misnames them.""",
    intervals="attribution_intervals.csv",
    metrics=(read_all_metrics, ("metrics.csv", "timings.csv")),
)
def table1_extended(run: Run, intervals, metrics):
    entries = {name: explainer_entry(name) for name in run.section("explainers")}

    def more(row: Row, _subset: Frame) -> dict[str, Cell | None]:
        measured = where(metrics, {**row.where, "concept": ALL})
        cells = {}
        for metric in [metric for metric, column in EXTENDED.items() if not isinstance(column, Show)]:
            counted = "causal_samples" if metric == "causal_samples" else "test_samples"
            samples = int(where(measured, {"metric": counted})["value"].sum())
            values_R = where(measured, {"metric": metric})["value"].to_numpy()
            cells[metric] = cell_of_repeats(values_R * (100 if metric == "abstention_rate" else 1), samples)
        return cells

    rows = crossed(("source", run.source_titles), ("method", titles(run)))
    rows = with_label(rows, lambda row: entries[row.where["method"]].sight)
    rows = [replace(row, rival=not entries[row.where["method"]].oracle) for row in rows]
    heads = {"source": "Dataset", "explainer": "Explainer", "reads": "Reads"}
    enough = intervals[(intervals["metric"] != "causal_accuracy") | (intervals["samples"] >= LEAST_CAUSAL)]
    sheet = Sheet("table1_extended", heads, rows, EXTENDED, enough, more=more)
    filled = {metric for _, metric in sheet.cells}
    apart = ", oracles apart" if any(entry.oracle for entry in entries.values()) else ""
    notes = {"accuracy": f"Bold: best accuracy on the dataset{apart}. Abstained samples are wrong.", **NOTES}
    footnotes = (
        repeats(cell for (_, key), cell in sheet.cells.items() if key == "accuracy"),
        "Reads: what an explainer sees of a registration; chance and the most frequent label see nothing.",
        *(note for metric, note in notes.items() if metric in filled),
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
