"""Makes the tables of explainers with other estimators and other registration methods beneath them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from gpca.evaluation.measures import ALL
from gpca.experiments.substitution.metrics import ANOTHER, MONTE_CARLO
from gpca.objects.entry import stand_in_clause
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.builder import TableBuilder, crossed, missing_packages, over_clusters
from gpca.reporting.tables.cells import clustered_cell, rows_where
from gpca.reporting.tables.table import Column, Table
from gpca.reporting.words import span

if TYPE_CHECKING:
    import pandas as pd

_OF_ESTIMATORS = {
    "agreement": Column("As with Monte-Carlo"),
    "abstained": Column("Abstained", interval=False),
    "no_estimate": Column("No estimate", interval=False),
}


def table14_estimator_explanations(
    intervals: pd.DataFrame,
    sources: Mapping[str, Mapping],
    explainers: Mapping[str, str],
    estimators: Mapping[str, str],
) -> Table:
    """Return accuracy in all and by concept, and what agrees with Monte-Carlo: explainers × estimators.

    Args:
        intervals: What :func:`gpca.experiments.substitution.metrics.collect_intervals` returned.
    """
    table = TableBuilder("table14_estimator_explanations", {"explainer": "Explainer", "estimator": "Uncertainty by"})
    causes = (ALL, *CONCEPTS)
    for (explainer, name), labels in crossed(explainers, estimators):
        rows = rows_where(intervals, table=explainer, method=name)
        cells = {key: clustered_cell(rows, metric="accuracy", concept=key) for key in causes}
        cells |= {key: clustered_cell(rows, metric=key, concept=ALL) for key in _OF_ESTIMATORS}
        if name == MONTE_CARLO:
            cells["agreement"] = None  # with itself
        table.add_row(labels, cells)
    table.compare_down([ALL], same=1)
    return table.build(
        caption="Accuracy (%) with each estimator in place of Monte-Carlo" + stand_in_clause(sources.values()),
        column_head="metric",
        columns={key: Column(key.capitalize()) for key in causes} | _OF_ESTIMATORS,
        footnotes=(
            f"{over_clusters(table.most_seeds())}. Shares of {_samples(table, ALL)}, {_of_concepts(table)} of each "
            "concept. Bold: best of an explainer.",
            "The uncertainty is how far the covariance diverges from that of the untouched pair, as in Table I. As "
            "with Monte-Carlo: share of the samples with the same answer.",
            "Abstained: all concepts have the same value. No estimate: the estimator failed or refused under at least "
            "one condition, and the sample counts as wrong.",
        ),
    )


def table14_method_matrix(
    intervals: pd.DataFrame,
    sources: Mapping[str, Mapping],
    explainers: Mapping[str, str],
    methods: Mapping[str, str],
    left_out: Mapping[str, str],
) -> Table:
    """Return the accuracy of explainers × the method learned from, by that of the test registrations.

    Args:
        intervals: What :func:`gpca.experiments.substitution.metrics.collect_intervals` returned.
        left_out: The package that is missing, by the title of the method that needs it.
    """
    table = TableBuilder("table14_method_matrix", {"explainer": "Explainer", "learnt_from": "Learned from"})
    names = [*methods, ANOTHER]
    for (explainer, learned_from), labels in crossed(explainers, methods):
        rows = rows_where(intervals, table=explainer, metric="accuracy", concept=learned_from)
        cells = {name: clustered_cell(rows, method=name) for name in names}
        table.add_row(labels, cells)
    table.compare_down(methods, same=1)
    columns = {name: Column(f"on {title}") for name, title in methods.items()} | {ANOTHER: Column("on another (mean)")}
    shown = {key for _, key in table.cells}
    return table.build(
        caption="Accuracy (%) from each registration method to each other" + stand_in_clause(sources.values()),
        column_head="asked_of",
        columns={name: column for name, column in columns.items() if name in shown},
        footnotes=(
            f"{over_clusters(table.most_seeds())}. Shares of {_samples(table, next(iter(methods)))}. Bold: best on a "
            "method.",
            "The explainer learns from registrations by one method and explains the same test pairs as registered by "
            "another; the encoder is the run's own, which has seen point-to-point alone.",
            *_failed(intervals, table, methods),
            *missing_packages(left_out),
        ),
    )


def _samples(table: TableBuilder, column: str) -> str:
    """Return how many test samples the first row's cell in a column has, in words."""
    return f"{table.first_cell(column).test_samples} test samples of all datasets together"


def _of_concepts(table: TableBuilder) -> str:
    return span(cell.test_samples for (row, key), cell in table.cells.items() if row == 0 and key in CONCEPTS)


def _failed(intervals: pd.DataFrame, table: TableBuilder, methods: Mapping[str, str]) -> list[str]:
    explainer, learned_from = (key for key, _ in table.rows[0])
    rows = rows_where(intervals, table=explainer, metric="failed", concept=learned_from)
    shares = {title: clustered_cell(rows, method=name) for name, title in methods.items()}
    failed = ", ".join(f"{title} {cell.mean:.1f} %" for title, cell in shares.items() if cell)
    return [f"Registrations that failed by the method's own account, which are explained like any other: {failed}."]
