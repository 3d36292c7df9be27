"""Makes the tables of explainers, each ``{"title": str, "oracle": bool, "sees": str}`` here.

The intervals are what :func:`gpca.experiments.concept_attribution.intervals.collect_intervals` returned.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import inf
from typing import TYPE_CHECKING

from gpca.evaluation.measures import ALL
from gpca.explainers.gpca import GPCA_FORMS
from gpca.reporting.tables.builder import TableBuilder, crossed, over_clusters, titles_of
from gpca.reporting.tables.cells import cell_of_repeats, clustered_cell, rows_where
from gpca.reporting.tables.table import EMPTY, Cell, Column, Table
from gpca.reporting.words import span

if TYPE_CHECKING:
    import pandas as pd

TABLE1 = ("shap_additive", "sa_local_additive", *GPCA_FORMS)  # The paper has SHAP, SA and GP-CA; ours trains longer.
EXTENDED = {  # Each of these metrics has a column in table1_extended.
    "accuracy": Column("Accuracy (%)"),
    "permuted_accuracy": Column("Relabeled (%)"),
    "causal_accuracy": Column("Causal (%)"),
    "causal_samples": Column("n causal", decimals=0, interval=False, limits=(0, inf)),
    "abstention_rate": Column("Abstained (%)", interval=False),
    "icp_calls": Column("ICP calls", decimals=0, interval=False, limits=(0, inf)),
    "seconds_per_sample": Column("Seconds", decimals=3, interval=False, limits=(0, inf)),
    "test_samples": Column("n", decimals=0, interval=False, limits=(0, inf)),
}
_WITH_INTERVALS = ("accuracy", "permuted_accuracy", "causal_accuracy")
_LEAST_CAUSAL = 30  # causal samples of all seeds; the accuracy on fewer says nothing


def table1_single_baselines(
    intervals: pd.DataFrame, sources: Mapping[str, Mapping], explainers: Mapping[str, Mapping]
) -> Table:
    """Return the accuracy of single-concept attribution (Table I): sources by those of `TABLE1` with predictions."""
    shown = [name for name in TABLE1 if name in explainers and (intervals["method"] == name).any()]
    table = TableBuilder("table1_single_baselines", {"source": "Dataset"})
    for (source,), labels in crossed(titles_of(sources)):
        table.add_row(labels, {name: _cell(intervals, source, name) for name in shown})
    table.compare_across(shown)
    return table.build(
        caption="Mean accuracy of single-concept attribution (%)" + table.stand_in_clause(sources),
        column_head="explainer",
        columns={name: Column(explainers[name]["title"]) for name in shown},
        footnotes=(
            _repeats(table, intervals, shown),
            *_different_samples(intervals, explainers, shown),
            "Abstained samples count as wrong.",
        ),
    )


def table1_extended(
    intervals: pd.DataFrame,
    metrics: pd.DataFrame,
    sources: Mapping[str, Mapping],
    explainers: Mapping[str, Mapping],
) -> Table:
    """Return every explainer on every source by the metrics of `EXTENDED` that were measured.

    The best accuracy of a source is bold, oracles apart: they are told what the others have to find out.

    Args:
        metrics: Tidy metrics and timings.
    """
    table = TableBuilder("table1_extended", {"source": "Dataset", "explainer": "Explainer", "reads": "Reads"})
    for (source, explainer), labels in crossed(titles_of(sources), _titles(explainers)):
        cells = {metric: _cell(intervals, source, explainer, metric=metric) for metric in _WITH_INTERVALS}
        cells |= {
            metric: _mean(metrics, source, explainer, metric) for metric in EXTENDED if metric not in _WITH_INTERVALS
        }
        sees = explainers[explainer]["sees"]
        table.add_row([*labels, (sees, sees)], cells, rival=not explainers[explainer]["oracle"])
    table.compare_down(["accuracy"], same=1)
    measured = {metric for _, metric in table.cells}
    apart = ", oracles apart" if any(entry["oracle"] for entry in explainers.values()) else ""
    notes = {
        "accuracy": f"Bold: best accuracy on the dataset{apart}. Abstained samples are wrong.",
        "permuted_accuracy": (
            "Relabeled: accuracy under the best one-to-one renaming of the predicted concepts, which takes the truth "
            "to find; where it is far above the accuracy, concepts are told apart but named wrongly."
        ),
        "causal_accuracy": (
            "Causal: accuracy on the n causal samples whose uncertainty lies above the 95th percentile of the clean "
            f"ones of their dataset and seed; {EMPTY} where there are fewer than {_LEAST_CAUSAL} in all seeds."
        ),
        "icp_calls": "ICP calls: ICP runs per sample beyond the observed registration.",
        "seconds_per_sample": (
            "Seconds: all that one sample takes, the observed registration included; "
            "the one column that differs from run to run."
        ),
        "test_samples": (
            "n: test samples of a seed; fewer where each takes hundreds of ICP calls (uncertainty.*.samples, config)."
        ),
    }
    return table.build(
        caption="Single-concept attribution by every explainer" + table.stand_in_clause(sources),
        column_head="metric",
        columns={metric: column for metric, column in EXTENDED.items() if metric in measured},
        footnotes=(
            _repeats(table, intervals, explainers),
            "Reads: what an explainer sees of a registration; chance and the most frequent label see nothing.",
            *(note for metric, note in notes.items() if metric in measured),
        ),
    )


def table2_per_concept(
    intervals: pd.DataFrame, sources: Mapping[str, Mapping], explainers: Mapping[str, Mapping]
) -> Table:
    """Return the accuracy per concept (Table II): sources × those of `GPCA_FORMS` with predictions, by concepts.

    The best concept of a row is bold, as in the paper.
    """
    concepts = [concept for concept in intervals["concept"].unique() if concept != ALL]
    shown = {name: title for name, title in _titles(explainers).items() if name in GPCA_FORMS}
    table = TableBuilder("table2_per_concept", {"source": "Dataset", "explainer": "Explainer"})
    for (source, explainer), labels in crossed(titles_of(sources), shown):
        table.add_row(labels, {c: _cell(intervals, source, explainer, c) for c in (*concepts, ALL)})
    table.compare_across(concepts)
    return table.build(
        caption="Mean accuracy per concept (%)" + table.stand_in_clause(sources),
        column_head="concept",
        columns={concept: Column(concept.capitalize()) for concept in (*concepts, ALL)},
        footnotes=(
            _repeats(table, intervals, shown),
            "Of the test samples that truly are of a concept, the share that is attributed to it.",
        ),
    )


def _titles(explainers: Mapping[str, Mapping]) -> dict[str, str]:
    return {name: entry["title"] for name, entry in explainers.items()}


def _cell(
    intervals: pd.DataFrame, source: str, explainer: str, concept: str = ALL, metric: str = "accuracy"
) -> Cell | None:
    cell = clustered_cell(intervals, source=source, method=explainer, metric=metric, concept=concept)
    return None if cell and metric == "causal_accuracy" and cell.test_samples < _LEAST_CAUSAL else cell


def _mean(metrics: pd.DataFrame, source: str, explainer: str, metric: str) -> Cell | None:
    """Return the mean over the seeds of what has no interval."""
    of_cell = rows_where(metrics, source=source, method=explainer, concept=ALL)
    values_R = rows_where(of_cell, metric=metric)["value"].to_numpy() * (100 if metric == "abstention_rate" else 1)
    counted = "causal_samples" if metric.startswith("causal") else "test_samples"
    return cell_of_repeats(values_R, int(rows_where(of_cell, metric=counted)["value"].sum()))


def _repeats(table: TableBuilder, intervals: pd.DataFrame, explainers: Iterable[str]) -> str:
    """Return the footnote on the repeats; seeds and test samples may differ from cell to cell."""
    of_test = _accuracies(intervals, explainers)
    samples = span(_per_seed(of_test[of_test["source"].isin(table.first_labels())]))
    return f"{over_clusters(table.span_of_seeds(), samples)}."


def _different_samples(intervals: pd.DataFrame, explainers: Mapping[str, Mapping], shown: Iterable[str]) -> list[str]:
    """Return the footnote on the test samples of each explainer, where their numbers differ."""
    names: dict[str, list[str]] = {}
    for explainer, rows in _accuracies(intervals, shown).groupby("method", sort=False):
        names.setdefault(span(_per_seed(rows)), []).append(explainers[explainer]["title"])
    explained = "; ".join(f"{samples} by {', '.join(titles)}" for samples, titles in names.items())
    return [f"Test samples explained: {explained}."] if len(names) > 1 else []


def _accuracies(intervals: pd.DataFrame, explainers: Iterable[str]) -> pd.DataFrame:
    return rows_where(intervals[intervals["method"].isin(list(explainers))], metric="accuracy", concept=ALL)


def _per_seed(rows: pd.DataFrame) -> pd.Series:
    return rows["samples"] // rows["seeds"]
