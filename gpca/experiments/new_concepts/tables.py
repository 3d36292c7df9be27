"""Makes the tables of new concepts where no encoder has seen the samples, or the concept.

The metrics are those of ``active_learning.csv``, with which the others are compared, and of ``new_concepts.csv``. The
``conditions`` are the sections ``active_learning`` and ``new_concepts`` of the config, with the ``seeds`` that the
latter was run for, ``test`` of its ``registrations``, and its section ``causes`` as ``of_causes``. The ``clusters`` say
of how many families the test samples of each source and seed are.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from gpca.active_learning.curves import TABLE
from gpca.active_learning.settings import ALL_LABELS
from gpca.causes.drawing import apportion
from gpca.causes.truth import BORDERLINE, GEOMETRY, NOMINAL
from gpca.evaluation.measures import ALL
from gpca.experiments.active_learning.clusters import Clusters
from gpca.experiments.active_learning.tables import COUNT, Quantity, cell_of
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.builder import TableBuilder, cautious_over, crossed, titles_of
from gpca.reporting.tables.cells import cell_of_repeats, clustered_cell, plain_cell, rows_where
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

SEEN = {
    "pretrained": "same samples, all concepts",
    "other_samples": "other samples, all concepts",
    "other_source": "another dataset, all concepts",
    "unseen": "same samples, known concepts only",
    "pair": "nothing: measurements of the pair",
}
NO_LABELS = {"chance": "no labels: chance", "rule": "no labels: rule of three lines"}  # what needs none
NEW_CAUSES = (NOMINAL, GEOMETRY)
PAPERS, WITHIN = "bald_kmeans", 20  # labels that a new concept may cost


def table15_new_concepts(
    metrics: pd.DataFrame,
    without_labels: pd.DataFrame,
    clusters: Clusters,
    clusters_of_causes: Clusters,
    sources: Mapping[str, Mapping],
    conditions: Mapping,
) -> Table:
    """Return the labels that each new concept costs in each embedding, and the accuracy that labels can reach.

    Args:
        without_labels: What :func:`gpca.experiments.concept_attribution.collect_intervals` returned of the
            explainers of `NO_LABELS`, for the same seeds.
        clusters_of_causes: The same of the registrations with measured causes.
    """
    metrics = metrics[metrics["seed"].isin(conditions["seeds"])]
    labels = {f"labels_{c}": Quantity("labels_to_target", Column(f"Labels, {c}", **COUNT), PAPERS, c) for c in CONCEPTS}
    labels["labels_random"] = Quantity("labels_to_target", Column("Labels, random choice", **COUNT), "random")
    accuracies = {"all_labels": Quantity("final_accuracy", Column("Acc., pool labeled (%)"), ALL_LABELS)}
    within = Column(f"Within {WITHIN} labels (%)", decimals=0, interval=False)
    tests = tests_of_causes(conditions)
    of_causes = {}
    for cause in NEW_CAUSES:
        of_causes[cause] = Quantity("final_accuracy", Column(f"{cause.capitalize()}, BALD (%)"), PAPERS, cause)
        of_causes[f"{cause}_all"] = Quantity(
            "final_accuracy", Column(f"{cause.capitalize()}, pool labeled (%)", interval=False), ALL_LABELS, cause
        )
    table = TableBuilder("table15_new_concepts", {"source": "Dataset", "seen": "Encoder learned from"})
    for (source, setting), row_labels in crossed(titles_of(sources), SEEN):
        of_row = rows_where(metrics, source=source, table=TABLE + setting)
        of_concepts = of_row[of_row["concept"].isin(CONCEPTS)]
        test = conditions["test"]
        cells = {key: cell_of(of_concepts, quantity, test, clusters) for key, quantity in (labels | accuracies).items()}
        cells["within"] = _within(of_concepts, test)
        cells |= {
            key: cell_of(of_row, quantity, tests[str(quantity.concept)], clusters_of_causes)
            for key, quantity in of_causes.items()
        }
        table.add_row(row_labels, cells, rival=setting != "pretrained")
    for (source, explainer), row_labels in crossed(titles_of(sources), NO_LABELS):
        accuracy = clustered_cell(without_labels, source=source, method=explainer, metric="accuracy", concept=ALL)
        cells = _without_labels(accuracy, labels, conditions["target"])
        table.add_row(row_labels, cells, rival=False)
    table.compare_down([*labels, "within", *NEW_CAUSES], same=1)
    columns = {key: quantity.column for key, quantity in labels.items()} | {"within": within}
    columns |= {key: quantity.column for key, quantity in (accuracies | of_causes).items()}
    return table.build(
        caption=f"Labels until a new concept is known, to {conditions['target']:.0%}, by what the encoder saw before"
        + table.stand_in_clause(sources, partly=False),
        column_head="quantity",
        columns={key: column for key, column in columns.items() if any(shown == key for _, shown in table.cells)},
        footnotes=(
            f"{cautious_over(table.span_of_seeds(), conditions['test'])}. A dash stands for what was not run. Bold: "
            "best of a dataset, the first row apart.",
            _protocol(conditions),
            "Labels: by BALD with k-means, for each concept as the new one, and by random choice, mean over the three. "
            f"Within {WITHIN} labels: share of the runs that reached the target with so few. Pool labeled: accuracy "
            "when the whole pool is labeled, mean over the three.",
            "No labels: the accuracy that needs none, with the interval of a bootstrap over families and seeds, and 0 "
            "labels where it reaches the target.",
            "Nominal, Geometry: the new concept in registrations with measured causes, of objects that no method saw; "
            "accuracy over all causes after all queries by BALD, and with the whole pool labeled. No encoder saw "
            f"Geometry. Test samples of a seed: {tests[NOMINAL]}, with Geometry up to {tests[GEOMETRY]}, if any of its "
            f"registrations fails by that{_fewer(table)}.",
        ),
    )


def table15_oracle(
    metrics: pd.DataFrame, clusters: Clusters, sources: Mapping[str, Mapping], conditions: Mapping
) -> Table:
    """Return the results of learning from an oracle that errs: labels to the target, final accuracy, by its errors."""
    metrics = metrics[metrics["seed"].isin(conditions["seeds"])]
    shares = [0, *(round(100 * share) for share in conditions["errors"])]
    labels = {f"labels_{share}": Column(f"Labels, {share} % wrong", **COUNT) for share in shares}
    accuracies = {f"accuracy_{share}": Column(f"Acc., {share} % wrong (%)") for share in shares}
    table = TableBuilder(
        "table15_oracle", {"source": "Dataset", "seen": "Encoder learned from", "strategy": "Strategy"}
    )
    seen = {setting: words for setting, words in SEEN.items() if setting in conditions["erring"]}
    strategies = {PAPERS: "BALD + k-means", "random": "Random"}
    for (source, setting, strategy), row_labels in crossed(titles_of(sources), seen, strategies):
        cells: dict[str, Cell | None] = {}
        for share in shares:
            name = TABLE + (f"{setting}_errors_{share}" if share else setting)
            of_cell = rows_where(metrics, source=source, table=name, method=strategy)
            of_cell = of_cell[of_cell["concept"].isin(CONCEPTS)]
            for key, metric in (("labels", "labels_to_target"), ("accuracy", "final_accuracy")):
                quantity = Quantity(metric, Column(""))
                cells[f"{key}_{share}"] = cell_of(of_cell, quantity, conditions["test"], clusters)
        table.add_row(row_labels, cells)
    table.compare_down([*labels, *accuracies], same=2)
    return table.build(
        caption=f"Labels until a new concept is known, to {conditions['target']:.0%}, from an oracle that errs"
        + table.stand_in_clause(sources, partly=False),
        column_head="quantity",
        columns=labels | accuracies,
        footnotes=(
            f"{cautious_over(table.most_seeds(), conditions['test'])}.",
            _protocol(conditions),
            "Means over noise, pose and overlap as the new concept, then over the seeds. A wrong answer names one of "
            "the other two concepts; an oracle that errs more repeats the errors of one that errs less. The labels at "
            "the start are right.",
        ),
    )


def tests_of_causes(conditions: Mapping) -> dict[str, int]:
    """Return how many test samples a seed has where a cause is the new concept: those with a label, and its own."""
    causes = conditions["of_causes"]
    labeled = apportion(causes["test"], causes["shares"])
    judged = causes["test"] - labeled[BORDERLINE] - labeled[GEOMETRY]
    return {NOMINAL: judged, GEOMETRY: judged + conditions["geometry_test"]}


def _fewer(table: TableBuilder) -> str:
    """Return the words on the datasets with fewer seeds of Geometry than of the rest, if there are any."""
    most = table.most_seeds()
    seeds_of = {
        table.rows[row][0][1]: plural(cell.seeds, "seed")
        for (row, key), cell in table.cells.items()
        if key == GEOMETRY and cell.seeds < most
    }
    return f" ({', '.join(f'{title}: {seeds}' for title, seeds in seeds_of.items())})" if seeds_of else ""


def _within(metrics: pd.DataFrame, test: int) -> Cell | None:
    wide = rows_where(metrics, method=PAPERS).pivot_table(index=["seed", "concept"], columns="metric", values="value")
    if not {"labels_to_target", "reached"} <= set(wide):
        return None
    done = (wide["labels_to_target"] <= WITHIN) & (wide["reached"] == 1)
    shares = 100 * done.groupby(level="seed").mean()
    return cell_of_repeats(shares, test * len(shares))


def _without_labels(accuracy: Cell | None, labels: Iterable[str], target: float) -> dict[str, Cell | None]:
    """Return the accuracy of what needs no labels as that of the whole pool, and where it is enough, that it has none.

    Args:
        accuracy: in %, if it is known.
        labels: the columns of numbers of labels.
    """
    enough = labels if accuracy and accuracy.mean >= 100 * target else ()
    return {"all_labels": accuracy} | {
        key: plain_cell(0, accuracy.seeds, accuracy.test_samples) for key in enough if accuracy
    }


def _protocol(conditions: Mapping) -> str:
    return (
        f"Start: {conditions['initial']} labeled samples of the known concepts; {conditions['batch']} labels a round, "
        f"{conditions['labels']} in all; '>': some runs did not reach the target and count with all labels."
    )
