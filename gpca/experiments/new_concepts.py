"""Labels that a classifier needs for a concept that no encoder has seen, of samples that none has seen (Table XV)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from gpca.active_learning.curves import TABLE, collect_curves
from gpca.active_learning.settings import ALL_LABELS, NEW_CONCEPT_STRATEGIES, NewConceptSettings
from gpca.causes.drawing import apportion
from gpca.causes.truth import BORDERLINE, GEOMETRY, NOMINAL
from gpca.declarations.experiment import Experiment
from gpca.declarations.plan import Run
from gpca.declarations.result import Figure, Frame, Paths, figure, numbers, table
from gpca.declarations.step import Plan, Step
from gpca.encoders.registry import encoder_module
from gpca.evaluation.measures import ALL, read_all_metrics
from gpca.experiments.active_learning import learning_settings
from gpca.experiments.concept_attribution import PREDICTIONS, collect_intervals
from gpca.experiments.label_curves import (
    COUNT,
    Clusters,
    draw_curves,
    families,
    families_with_causes,
    label_cells,
    mean_curves,
    quantity,
)
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures.style import BLUE, GRAY, GREEN, SKY_BLUE, VERMILION
from gpca.reporting.tables.builder import TableBuilder, cautious_over, crossed
from gpca.reporting.tables.cells import cell_of_repeats, clustered_cell, plain_cell, rows_where
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import plural

SEEN = {
    "pretrained": "same samples, all concepts",
    "other_samples": "other samples, all concepts",
    "other_source": "another dataset, all concepts",
    "unseen": "same samples, known concepts only",
    "pair": "nothing: measurements of the pair",
}
NO_LABELS = {"chance": "no labels: chance", "rule": "no labels: rule of three lines"}
NEW_CAUSES = (NOMINAL, GEOMETRY)
PAPERS, WITHIN = "bald_kmeans", 20  # labels that a new concept may cost


def seeds(config: Mapping[str, Any]) -> list[int]:
    return list(config["seeds"])[: config["new_concepts"]["seeds"]]


EXPERIMENT = Experiment(
    name="new_concepts",
    sections={"new_concepts": NewConceptSettings},
    names=lambda config, sources: {
        "new_concept_strategy": list(NEW_CONCEPT_STRATEGIES),
        "new_concept_seed": seeds(config),
        "erring": list(config["new_concepts"]["erring"]),  # embeddings for which the oracle also makes errors
    },
)


def _other_encoders(plan: Plan, wildcards: Any) -> dict[str, str]:
    """Encoders that saw other samples: those of the next seed, and of the next source, where there are any."""
    section, encoder = plan.config["new_concepts"], plan.config["embedding"]["encoder"]

    def following(names: Iterable[Any], name: str) -> str:
        names = [str(each) for each in names]
        return names[(names.index(name) + 1) % len(names)]

    others = {
        "other_samples": (wildcards.source, following(plan.config["seeds"], wildcards.seed)),
        "other_source": (following(plan.sources, wildcards.source), wildcards.seed),
    }
    return {
        name: f"encoders/{source}/{encoder}/seed{seed}.pt"
        for name, (source, seed) in others.items()
        if name in section["embeddings"] and (source, seed) != (wildcards.source, wildcards.seed)
    }


LEARN = Step(
    name="learn_new_concepts",
    run="gpca.steps.new_concepts",
    inputs={
        "registrations": "registrations/{source}/seed{seed}.npz",
        "encoders": lambda plan, wildcards: [*_other_encoders(plan, wildcards).values()],
        "objects": "objects/{source}.npz",
        "causes": "causes/{source}/seed{seed}.npz",
        "descriptors": "descriptors/{source}/seed{seed}.npz",
        "cause_encoder": "cause_encoders/{source}/seed{seed}.pt",
        "cause_embeddings": "cause_embeddings/{source}/seed{seed}.npz",
    },
    outputs={"out": "new_concepts/{source}/{*strategy}/seed{seed}.csv"},
    where={"strategy": "new_concept_strategy"},
    settings=lambda plan, _wildcards: {
        "new_concepts": plan.config["new_concepts"],
        "active_learning": learning_settings(plan),
        "encoder": plan.encoder,
        "cause_encoder": plan.config["diagnosis"]["encoder"],
        "causes": plan.config["causes"],
        "descriptors": plan.config["diagnosis"]["descriptors"],
        "icp": plan.config["registrations"]["icp"],
    },
    params={"encoders_of": lambda plan, wildcards: [*_other_encoders(plan, wildcards)]},
    modules=lambda plan: [plan.encoder_module, encoder_module(plan.config["diagnosis"]["encoder"])],
    priority=6,
)


@numbers("new_concepts.csv", files="new_concepts/{source}/{new_concept_strategy}/seed{new_concept_seed}.csv")
def collect(run: Run, files: Paths) -> Frame:
    return collect_curves(files, run.config["active_learning"]["target"])


SECTION = "Beyond the paper: concepts that no encoder has seen"
METRICS = (read_all_metrics, ("active_learning.csv", "new_concepts.csv"))
CLUSTERS = (families, "registrations/{source}/seed{new_concept_seed}.npz")


@table(
    SECTION,
    "Table XV: a new concept without leakage",
    """In the paper the encoder may have seen the new concept, and even the same samples, before the classifier learns
    it. Here the rows differ in what the encoder learned from: other samples, another dataset, no labels, or nothing,
    with measurements of both clouds in its place. Fewer labels are better. The last columns have new concepts of
    another kind: nothing is wrong, and the shape does not determine the pose. The last rows of all need no label.""",
    only={"explainer": tuple(NO_LABELS)},
    metrics=METRICS,
    without_labels=(collect_intervals, PREDICTIONS.replace("{seed}", "{new_concept_seed}")),
    clusters=CLUSTERS,
    cause_clusters=(families_with_causes, "causes/{source}/seed{new_concept_seed}.npz"),
)
def table15_new_concepts(
    run: Run, metrics: Frame, without_labels: Frame, clusters: Clusters, cause_clusters: Clusters
) -> Table:
    learning, test = run.config["active_learning"], run.config["registrations"]["test"]
    metrics = metrics[metrics["seed"].isin(seeds(run.config))]
    labels = {f"labels_{c}": quantity("labels_to_target", f"Labels, {c}", PAPERS, c, **COUNT) for c in CONCEPTS}
    labels["labels_random"] = quantity("labels_to_target", "Labels, random choice", "random", **COUNT)
    accuracies = {"all_labels": quantity("final_accuracy", "Acc., pool labeled (%)", ALL_LABELS)}
    within = Column(f"Within {WITHIN} labels (%)", decimals=0, interval=False)
    tests = tests_with_causes(run)
    with_causes = {}
    for cause in NEW_CAUSES:
        title = cause.capitalize()
        with_causes[cause] = quantity("final_accuracy", f"{title}, BALD (%)", PAPERS, cause)
        with_causes[f"{cause}_all"] = quantity(
            "final_accuracy", f"{title}, pool labeled (%)", ALL_LABELS, cause, interval=False
        )
    builder = TableBuilder("table15_new_concepts", {"source": "Dataset", "seen": "Encoder learned from"})
    for (source, setting), titles in crossed(run.source_titles, SEEN):
        selected = rows_where(metrics, source=source, table=TABLE + setting)
        rows = selected[selected["concept"].isin(CONCEPTS)]
        cells = {key: label_cells(test, clusters)(rows, column) for key, column in (labels | accuracies).items()}
        of_papers = rows_where(rows, method=PAPERS)
        wide = of_papers.pivot_table(index=["seed", "concept"], columns="metric", values="value")
        if {"labels_to_target", "reached"} <= set(wide):
            done = (wide["labels_to_target"] <= WITHIN) & (wide["reached"] == 1)
            shares = 100 * done.groupby(level="seed").mean()
            cells["within"] = cell_of_repeats(shares, test * len(shares))
        cells |= {
            key: label_cells(tests[column.where["concept"]], cause_clusters)(selected, column)
            for key, column in with_causes.items()
        }
        builder.add_row(titles, cells, rival=setting != "pretrained")
    for (source, explainer), titles in crossed(run.source_titles, NO_LABELS):
        accuracy = clustered_cell(without_labels, source=source, method=explainer, metric="accuracy", concept=ALL)
        cells = {"all_labels": accuracy}  # as of the whole pool, and 0 labels where it is enough
        if accuracy and accuracy.mean >= 100 * learning["target"]:
            cells |= dict.fromkeys(labels, plain_cell(0, accuracy.seeds, accuracy.test_samples))
        builder.add_row(titles, cells, rival=False)
    builder.compare_down([*labels, "within", *NEW_CAUSES], same=1)
    fewer = {}  # datasets with fewer seeds of Geometry than of the rest
    for (row, key), cell in builder.cells.items():
        if key == GEOMETRY and cell.seeds < builder.most_seeds():
            fewer[builder.labels[row][0][1]] = f"{builder.labels[row][0][1]}: {plural(cell.seeds, 'seed')}"
    of_fewer = f" ({', '.join(fewer.values())})" if fewer else ""
    columns = labels | {"within": within} | accuracies | with_causes
    return builder.build(
        caption=f"Labels until a new concept is known, to {learning['target']:.0%}, by what the encoder saw before"
        + run.stand_ins(partly=False),
        column_head="quantity",
        columns={key: column for key, column in columns.items() if any(shown == key for _, shown in builder.cells)},
        footnotes=(
            f"{cautious_over(builder.span_of_seeds(), test)}. A dash stands for what was not run. Bold: "
            "best of a dataset, the first row apart.",
            _protocol(learning),
            "Labels: by BALD with k-means, for each concept as the new one, and by random choice, mean over the three. "
            f"Within {WITHIN} labels: share of the runs that reached the target with so few. Pool labeled: accuracy "
            "when the whole pool is labeled, mean over the three.",
            "No labels: the accuracy that needs none, with the interval of a bootstrap over families and seeds, and 0 "
            "labels where it reaches the target.",
            "Nominal, Geometry: the new concept in registrations with measured causes, of objects that no method saw; "
            "accuracy over all causes after all queries by BALD, and with the whole pool labeled. No encoder saw "
            f"Geometry. Test samples of a seed: {tests[NOMINAL]}, with Geometry up to {tests[GEOMETRY]}, if any of its "
            f"registrations fails by that{of_fewer}.",
        ),
    )


@table(
    SECTION,
    "Table XV with an oracle that errs",
    """Table XV with an oracle that gives a share of wrong labels: how many more labels are needed to reach the target,
    and the accuracy after all of them.""",
    needs=("erring",),
    metrics=METRICS,
    clusters=CLUSTERS,
)
def table15_oracle(run: Run, metrics: Frame, clusters: Clusters) -> Table:
    learning, own, test = run.config["active_learning"], run.config["new_concepts"], run.config["registrations"]["test"]
    metrics = metrics[metrics["seed"].isin(seeds(run.config))]
    shares = [0, *(round(100 * share) for share in own["errors"])]
    labels = {f"labels_{share}": quantity("labels_to_target", f"Labels, {share} % wrong", **COUNT) for share in shares}
    accuracies = {f"accuracy_{share}": quantity("final_accuracy", f"Acc., {share} % wrong (%)") for share in shares}
    builder = TableBuilder(
        "table15_oracle", {"source": "Dataset", "seen": "Encoder learned from", "strategy": "Strategy"}
    )
    seen = {setting: words for setting, words in SEEN.items() if setting in own["erring"]}
    strategies = {PAPERS: "BALD + k-means", "random": "Random"}
    for (source, setting, strategy), titles in crossed(run.source_titles, seen, strategies):
        cells: dict[str, Cell | None] = {}
        for share in shares:
            name = TABLE + (f"{setting}_errors_{share}" if share else setting)
            cell_rows = rows_where(metrics, source=source, table=name, method=strategy)
            cell_rows = cell_rows[cell_rows["concept"].isin(CONCEPTS)]
            for key, column in ((f"labels_{share}", labels), (f"accuracy_{share}", accuracies)):
                cells[key] = label_cells(test, clusters)(cell_rows, column[key])
        builder.add_row(titles, cells)
    builder.compare_down([*labels, *accuracies], same=2)
    return builder.build(
        caption=f"Labels until a new concept is known, to {learning['target']:.0%}, from an oracle that errs"
        + run.stand_ins(partly=False),
        column_head="quantity",
        columns=labels | accuracies,
        footnotes=(
            f"{cautious_over(builder.most_seeds(), test)}.",
            _protocol(learning),
            "Means over noise, pose and overlap as the new concept, then over the seeds. A wrong answer names one of "
            "the other two concepts; an oracle that errs more repeats the errors of one that errs less. The labels at "
            "the start are right.",
        ),
    )


FIGURE_ROWS = {"concepts": CONCEPTS, "nominal": ("nominal",), "geometry": ("geometry",)}
FIGURE_TITLES = {"concepts": "new: noise, pose\nor overlap", "nominal": "new: nominal", "geometry": "new: geometry"}
STYLES = {
    "pretrained": (GRAY, "-", 0.9),
    "other_samples": (BLUE, "-", 0.9),
    "other_source": (SKY_BLUE, "-", 0.9),
    "unseen": (VERMILION, "-", 1.8),
    "pair": (GREEN, "-", 1.8),
}


def read_curves_by_concepts(files: Paths) -> dict[tuple[str, str, str], Frame]:
    files = list(files)
    return {
        (source, row, setting): curve
        for row, concepts in FIGURE_ROWS.items()
        for (source, strategy, setting), curve in mean_curves(files, concepts).items()
        if strategy == PAPERS
    }


@figure(
    SECTION,
    "Learning curves without leakage",
    """Accuracy over the number of labels chosen by BALD with k-means, by what the encoder learned from: the mean over
    the seeds, and in the first row over three concepts. The sooner a curve crosses the target line, the fewer
    labels the new concept costs.

    Bands are 95 % intervals over the seeds. Only the two thick curves have them, the encoder that knows the other
    concepts alone and the measurements of the pair; a thick curve without a band is of one seed.""",
    only={"pool_strategy": (PAPERS,)},
    curves=(
        read_curves_by_concepts,
        (
            "active_learning/{source}/{pool_strategy}/seed{new_concept_seed}.csv",
            "new_concepts/{source}/{pool_strategy}/seed{new_concept_seed}.csv",
        ),
    ),
)
def new_concept_curves(run: Run, curves: Mapping[tuple[str, str, str], Frame]) -> Figure:
    target = run.config["active_learning"]["target"]
    return draw_curves(curves, run.source_titles, FIGURE_TITLES, SEEN, STYLES, target)


def tests_with_causes(run: Run) -> dict[str, int]:
    """Test samples of a seed where a cause is the new concept: those with a label, and the concept's."""
    causes = run.config["causes"]
    labeled = apportion(causes["test"], causes["shares"])
    judged = causes["test"] - labeled[BORDERLINE] - labeled[GEOMETRY]
    return {NOMINAL: judged, GEOMETRY: judged + run.config["new_concepts"]["geometry_test"]}


def _protocol(learning: Mapping) -> str:
    return (
        f"Start: {learning['initial']} labeled samples of the known concepts; {learning['batch']} labels a round, "
        f"{learning['labels']} in all; '>': some runs did not reach the target and count with all labels."
    )
