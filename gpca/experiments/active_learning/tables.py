"""Makes the tables of active learning.

The ``conditions`` are its section of the config, with train and test samples, and ``clusters`` of how many families the
test samples of each source and seed are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Any

from gpca.active_learning.acquisition import STREAMS, require_strategy
from gpca.active_learning.curves import CENSORED_BY, TABLE
from gpca.active_learning.settings import LOOK_EVERY, rare_setting
from gpca.experiments.active_learning.clusters import Clusters
from gpca.reporting.tables.builder import TableBuilder, cautious_over, crossed, titles_of
from gpca.reporting.tables.cells import cautious_cell, cell_of_repeats, rows_where
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

PAPERS_HELD_OUT = "overlap"  # The paper's GPC knows noise and pose (Sec. IV-C).
SETTINGS = {"pretrained": "all concepts", "unseen": "the known concepts only"}
COUNT: dict[str, Any] = {"decimals": 0, "limits": (0, inf), "least_is_best": True}
_SHARES = ("reached", "area_under_curve", "area_gain")  # These and every accuracy lie in [0, 1] and are printed in %.
_OF_TEST_SAMPLES = ("final_accuracy", "final_accuracy_new", "area_under_curve")


@dataclass(frozen=True)
class Quantity:
    """Says what a column shows: a metric of all rows, or of one strategy or one concept held out."""

    metric: str
    column: Column
    strategy: str | None = None
    concept: str | None = None


def table3_active_learning(
    metrics: pd.DataFrame,
    clusters: Clusters,
    sources: Mapping[str, Mapping],
    strategies: Mapping[str, str],
    conditions: Mapping,
) -> Table:
    """Return the labels to the target accuracy by BALD, also with k-means, and at random (Table III).

    The rows are sources × settings: first those in which the new concept is rare and the paper's classifier learns it.
    """
    of_table = metrics[metrics["concept"] == PAPERS_HELD_OUT]
    shares = conditions["rare"]["shares"] if conditions["rare"] else ()
    settings = {rare_setting(share): f"all concepts; {100 * share:g} % of the pool new" for share in shares} | SETTINGS
    quantities = {
        "labels_bald_kmeans": Quantity(
            "labels_to_target", Column("Labels, BALD + k-means", **COUNT), strategy="bald_kmeans"
        ),
        "labels_bald": Quantity("labels_to_target", Column("Labels, BALD", **COUNT), strategy="bald"),
        "labels_random": Quantity("labels_to_target", Column("Labels, random", **COUNT), strategy="random"),
        "accuracy_bald_kmeans": Quantity("final_accuracy", Column("Acc. BALD (%)"), strategy="bald_kmeans"),
        "accuracy_random": Quantity("final_accuracy", Column("Acc. random (%)"), strategy="random"),
        "epochs_bald_kmeans": Quantity("epochs_at_target", Column("Epochs", **COUNT), strategy="bald_kmeans"),
    }
    table = TableBuilder("table3_active_learning", {"source": "Dataset", "setting": "Encoder saw"})
    for (source, setting), labels in crossed(titles_of(sources), settings):
        of_row = rows_where(of_table, source=source, table=TABLE + setting)
        table.add_row(labels, _cells(of_row, quantities, conditions, clusters))
    table.compare_across(["labels_bald_kmeans", "labels_bald", "labels_random"])
    return table.build(
        caption=f"Labels until a GPC that knew noise and pose reaches {conditions['target']:.0%} on all concepts"
        + table.stand_in_clause(sources, partly=False),
        column_head="quantity",
        columns=_columns(quantities),
        footnotes=(
            f"{cautious_over(table.most_seeds(), conditions['test'])}.",
            *_rare(conditions),
            f"{'Other rows: ' if shares else ''}{_protocol(conditions)} It moves the posterior alone, in at most "
            f"{conditions['iterations']} passes over the labels.",
            "Epochs: passes of the retraining that reached the target. Acc.: after all labels.",
        ),
    )


def _rare(conditions: Mapping) -> list[str]:
    if not (rare := conditions["rare"]):
        return []
    gpc = rare["gpc"]
    few = rare.get("beside_seeds")
    beside = f" Shares but the first: over at most the first {plural(few, 'seed')}." if few else ""
    return [
        "Where so many percent of the pool are new (5 % are compared with the paper), the paper's classifier "
        f"({gpc['kernel']}, rate {gpc['learning_rate']:g}, {gpc['iterations']} passes) is fitted anew in each round of "
        f"{rare['batch']} labels, and labels are counted one by one (docs/comparison.md). Start: "
        f"{conditions['initial']} labeled samples of the two known concepts. Labels are given until the target, at "
        f"least {rare['least']} (then {rare['late_batch']} a round), at most {rare['labels']} or the whole pool; '>': "
        f"some runs did not reach it. Epochs are counted in steps of {LOOK_EVERY}.{beside}"
    ]


def table3_extended(
    metrics: pd.DataFrame,
    clusters: Clusters,
    sources: Mapping[str, Mapping],
    strategies: Mapping[str, str],
    conditions: Mapping,
) -> Table:
    """Return every strategy, encoder and concept held out, with means over the three where one column is for all."""
    quantities = {
        f"labels_{c}": Quantity("labels_to_target", Column(f"Labels, {c}", **COUNT), concept=c)
        for c in _concepts(metrics)
    } | {
        "reached": Quantity("reached", Column("Reached (%)", decimals=0, interval=False)),
        "final_accuracy": Quantity("final_accuracy", Column("Accuracy (%)")),
        "final_accuracy_new": Quantity("final_accuracy_new", Column("New (%)")),
        "area_under_curve": Quantity("area_under_curve", Column("Area (%)")),
        "area_gain": Quantity("area_gain", Column("Gain (%)", limits=(-100, 100))),
    }
    table = TableBuilder("table3_extended", {"source": "Dataset", "setting": "Encoder saw", "strategy": "Strategy"})
    settings = {name: SETTINGS[name] for name in ("pretrained", "unseen")}
    of_pool = {name: title for name, title in strategies.items() if name not in STREAMS}
    for (source, setting, strategy), labels in crossed(titles_of(sources), settings, of_pool):
        of_row = rows_where(metrics, source=source, table=TABLE + setting, method=strategy)
        is_rival = not require_strategy(strategy).oracle
        table.add_row(labels, _cells(of_row, quantities, conditions, clusters), rival=is_rival)
    table.compare_down([key for key in quantities if key != "reached"], same=2)
    return table.build(
        caption=f"Active learning of a held-out concept by every strategy, to {conditions['target']:.0%}"
        + table.stand_in_clause(sources, partly=False),
        column_head="quantity",
        columns=_columns(quantities),
        footnotes=(
            f"{cautious_over(table.most_seeds(), conditions['test'])}.",
            _protocol(conditions),
            "Labels: until the target, by the concept held out. Reached: share of the runs that reached it. Accuracy: "
            "after all labels; New: that on the concept held out. Area: mean accuracy over the budget. Gain: area "
            "minus that of random sampling from the same start, paired by seed. All but Labels are means over the "
            "concepts held out, then over the seeds.",
        ),
    )


def table3_stream(
    metrics: pd.DataFrame,
    clusters: Clusters,
    sources: Mapping[str, Mapping],
    strategies: Mapping[str, str],
    conditions: Mapping,
) -> Table:
    """Return the stream form: labels asked for, arrivals until a new concept is recognized, accuracy."""
    stream = conditions["stream"]
    quantities = {
        f"delay_{c}": Quantity("delay", Column(f"Delay, {c}", **COUNT), concept=c) for c in _concepts(metrics)
    } | {
        "labels": Quantity("labels", Column("Labels", interval=False, **COUNT)),
        "new_labels": Quantity("new_labels", Column("Labels of the new", interval=False, **COUNT)),
        "running_accuracy": Quantity("running_accuracy", Column("Running (%)")),
        "final_accuracy": Quantity("final_accuracy", Column("Accuracy (%)")),
        "final_accuracy_new": Quantity("final_accuracy_new", Column("New (%)")),
    }
    table = TableBuilder("table3_stream", {"source": "Dataset", "strategy": "Strategy"})
    of_stream = {name: title for name, title in strategies.items() if name in STREAMS}
    for (source, strategy), labels in crossed(titles_of(sources), of_stream):
        of_row = rows_where(metrics, source=source, table=TABLE + "pretrained", method=strategy)
        table.add_row(labels, _cells(of_row, quantities, conditions, clusters))
    table.compare_down([key for key in quantities if "labels" not in key], same=1)
    return table.build(
        caption="A new concept in a stream of registrations" + table.stand_in_clause(sources, partly=False),
        column_head="quantity",
        columns=_columns(quantities),
        footnotes=(
            f"{cautious_over(table.most_seeds(), conditions['test'])}.",
            f"{stream['arrivals']} samples arrive one by one; the first {stream['quiet']} are of the two known "
            f"concepts ({conditions['initial']} labeled samples at the start); a third of the others is new. A label "
            f"may be requested for {stream['budget']:.0%} of the arrivals; the GPC learns it at once, or the learner "
            "that the row names, simplified as docs/active_learning.md says.",
            "Delay: arrivals from the first sample of the new concept until half of its test samples are named right; "
            "'>': some runs ended before. Running: accuracy over the last arrivals, each judged before its label is "
            "known. Accuracy, New: on all test samples and those of the new concept, at the end. All but Delay are "
            "means over the concepts held out, then over the seeds.",
        ),
    )


def _concepts(metrics: pd.DataFrame) -> list[str]:
    return list(dict.fromkeys(metrics["concept"]))


def _columns(quantities: Mapping[str, Quantity]) -> dict[str, Column]:
    return {key: quantity.column for key, quantity in quantities.items()}


def _cells(
    metrics: pd.DataFrame, quantities: Mapping[str, Quantity], conditions: Mapping, clusters: Clusters
) -> dict[str, Cell | None]:
    """Return the cells of a row, given its metrics."""
    return {key: cell_of(metrics, quantity, conditions["test"], clusters) for key, quantity in quantities.items()}


def cell_of(metrics: pd.DataFrame, quantity: Quantity, test: int, clusters: Clusters | None = None) -> Cell | None:
    """Return the mean of a quantity over the concepts held out that the rows hold, then over the seeds.

    Args:
        metrics: those of one source.
        test: its test samples of a seed.
        clusters: of how many clusters these are, which widen the interval of an accuracy.
    """
    if quantity.strategy is not None:
        metrics = rows_where(metrics, method=quantity.strategy)
    if quantity.concept is not None:
        metrics = rows_where(metrics, concept=quantity.concept)
    rows = rows_where(metrics, metric=quantity.metric)
    values_R = rows.groupby("seed")["value"].mean()
    scale = 100 if quantity.metric in _SHARES or "accuracy" in quantity.metric else 1
    samples = test * len(values_R)
    if clusters is not None and quantity.metric in _OF_TEST_SAMPLES:
        counted = sum(clusters[source, int(seed)] for source in rows["source"].unique() for seed in values_R.index)
        return cautious_cell(values_R * scale, samples, counted)
    done = rows_where(metrics, metric=CENSORED_BY.get(quantity.metric))["value"]
    return cell_of_repeats(values_R * scale, samples, at_least=bool((done < 1).any()))


def _protocol(conditions: Mapping) -> str:
    return (
        f"Start: {conditions['initial']} labeled samples of the two known concepts. Pool: the other "
        f"{conditions['train'] - conditions['initial']} training samples, with all of the new concept, a third of "
        f"{conditions['train']}. "
        f"{conditions['batch']} labels a round, {conditions['labels']} in all; '>': some runs did not reach the target "
        "and count with all labels. Every strategy gets the same start, pool, test samples and retraining."
    )
