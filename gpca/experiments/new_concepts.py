"""Labels that a classifier needs for a concept that no encoder has seen, of samples that none has seen (Table XV)."""

from collections.abc import Iterable, Mapping
from itertools import product
from typing import Any

from gpca.active_learning.curves import TABLE, collect_curves
from gpca.active_learning.settings import ALL_LABELS, NEW_CONCEPT_STRATEGIES, NewConceptSettings
from gpca.causes.drawing import apportion
from gpca.causes.truth import BORDERLINE, GEOMETRY, NOMINAL
from gpca.declarations.experiment import Experiment
from gpca.declarations.plan import Run
from gpca.declarations.result import Frame, Paths, numbers, table
from gpca.declarations.step import Plan, Step
from gpca.encoders.registry import encoder_module
from gpca.evaluation.measures import ALL, read_all_metrics
from gpca.experiments import label_curves as labeled
from gpca.experiments.active_learning import learning_settings
from gpca.experiments.concept_attribution import PREDICTIONS, collect_intervals
from gpca.experiments.label_curves import COUNT, Clusters, quantity
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.sheet import Row, Sheet, Show, crossed
from gpca.reporting.tables.builder import cautious_over
from gpca.reporting.tables.cells import cell_of_repeats, clustered_cell, plain_cell, rows_where, where
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
FIRST = "pretrained"  # the paper's own row, which competes with none
HEADS = {"source": "Dataset", "seen": "Encoder learned from"}


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
CLUSTERS = (labeled.families, "registrations/{source}/seed{new_concept_seed}.npz")


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
    cause_clusters=(labeled.families_with_causes, "causes/{source}/seed{new_concept_seed}.npz"),
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

    def cell(rows: Frame, column: Show) -> Cell | None:
        if (cause := column.where.get("concept")) in NEW_CAUSES:
            return labeled.label_cells(tests[cause], cause_clusters)(rows, column)
        return labeled.label_cells(test, clusters)(rows[rows["concept"].isin(CONCEPTS)], column)

    def share_within(_row: Row, rows: Frame) -> dict[str, Cell | None]:
        rows = rows_where(rows[rows["concept"].isin(CONCEPTS)], method=PAPERS)
        wide = rows.pivot_table(index=["seed", "concept"], columns="metric", values="value")
        if not {"labels_to_target", "reached"} <= set(wide):
            return {}
        done = (wide["labels_to_target"] <= WITHIN) & (wide["reached"] == 1)
        shares = 100 * done.groupby(level="seed").mean()
        return {"within": cell_of_repeats(shares, test * len(shares))}

    rows = [
        Row([source, seen], {"source": source[0], "table": TABLE + seen[0]}, rival=seen[0] != FIRST)
        for source, seen in product(run.source_titles.items(), SEEN.items())
    ]
    columns = labels | {"within": within} | accuracies | with_causes
    sheet = Sheet("table15_new_concepts", HEADS, rows, columns, metrics, more=share_within, cell=cell)
    for without in crossed(("source", run.source_titles), ("method", NO_LABELS)):
        accuracy = clustered_cell(where(without_labels, without.where), metric="accuracy", concept=ALL)
        cells = {"all_labels": accuracy}  # as of the whole pool, and 0 labels where it is enough
        if accuracy and accuracy.mean >= 100 * learning["target"]:
            cells |= dict.fromkeys(labels, plain_cell(0, accuracy.seeds, accuracy.test_samples))
        sheet.add_row(without.labels, cells, rival=False)
    fewer = {}  # datasets with fewer seeds of Geometry than of the rest
    for (row, key), shown in sheet.cells.items():
        if key == GEOMETRY and shown.seeds < sheet.seeds:
            title = sheet.labels[row][0][1]
            fewer[title] = f"{title}: {plural(shown.seeds, 'seed')}"
    seeds_of_fewer = f" ({', '.join(fewer.values())})" if fewer else ""
    caption = f"Labels until a new concept is known, to {learning['target']:.0%}, by what the encoder saw before"
    notes = (
        f"{cautious_over(sheet.span_of_seeds(), test)}. A dash stands for what was not run. Bold: "
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
        f"registrations fails by that{seeds_of_fewer}.",
    )
    bold = [*labels, "within", *NEW_CAUSES]
    return sheet.table(caption + run.stand_ins(partly=False), "quantity", notes, bold=bold, same=1)


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
    learning, section = run.config["active_learning"], run.config["new_concepts"]
    metrics = metrics[metrics["seed"].isin(seeds(run.config)) & metrics["concept"].isin(CONCEPTS)]
    shares, columns = [0, *(round(100 * share) for share in section["errors"])], {}
    for name, metric, title, look in (
        ("labels", "labels_to_target", "Labels, {} % wrong", COUNT),
        ("accuracy", "final_accuracy", "Acc., {} % wrong (%)", {}),
    ):
        for share in shares:
            wanted = {"metric": metric, "errors": str(share) if share else ""}
            columns[f"{name}_{share}"] = Show(title.format(share), where=wanted, **look)
    setting = metrics["table"].str.removeprefix(TABLE).str.partition("_errors_")
    seen = {name: words for name, words in SEEN.items() if name in section["erring"]}
    strategies = {PAPERS: "BALD + k-means", "random": "Random"}
    rows = crossed(("source", run.source_titles), ("seen", seen), ("method", strategies))
    test = run.config["registrations"]["test"]
    measured = metrics.assign(seen=setting[0], errors=setting[2])
    cell = labeled.label_cells(test, clusters)
    sheet = Sheet("table15_oracle", HEADS | {"strategy": "Strategy"}, rows, columns, measured, cell=cell)
    caption = f"Labels until a new concept is known, to {learning['target']:.0%}, from an oracle that errs"
    notes = (
        f"{cautious_over(sheet.seeds, test)}.",
        _protocol(learning),
        "Means over noise, pose and overlap as the new concept, then over the seeds. A wrong answer names one of "
        "the other two concepts; an oracle that errs more repeats the errors of one that errs less. The labels at "
        "the start are right.",
    )
    stand_ins = run.stand_ins(partly=False)
    return sheet.table(caption + stand_ins, "quantity", notes, bold=columns, same=2, keep_empty=True)


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
