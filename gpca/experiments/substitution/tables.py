"""Makes the tables of explainers with other estimators and other registration methods beneath them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from gpca.attribution.metrics import ALL
from gpca.experiments.substitution.metrics import ANOTHER, MONTE_CARLO
from gpca.objects.title import stand_in_clause
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.builder import TableBuilder, crossed, missing_packages
from gpca.reporting.tables.cells import WILSON, rows_where, share_over_sources
from gpca.reporting.tables.table import Column, Table
from gpca.reporting.words import plural, span

if TYPE_CHECKING:
    import pandas as pd

_INTERVAL = f"{WILSON}, as if all samples were independent; where seeds or objects differ, it is too narrow."
_OF_ESTIMATORS = {
    "agreement": Column("As with Monte-Carlo"),
    "abstained": Column("Abstained", interval=False),
    "no_estimate": Column("No estimate", interval=False),
}


def table14_estimator_explanations(
    metrics: pd.DataFrame,
    sources: Mapping[str, Mapping],
    explainers: Mapping[str, str],
    estimators: Mapping[str, str],
) -> Table:
    """Return accuracy in all and by concept, and what agrees with Monte-Carlo: explainers × estimators."""
    table = TableBuilder("table14_estimator_explanations", {"explainer": "Explainer", "estimator": "Uncertainty by"})
    causes = (ALL, *CONCEPTS)
    for (explainer, name), labels in crossed(explainers, estimators):
        rows = rows_where(metrics, table=explainer)
        cells = {key: share_over_sources(rows, sources, name, "accuracy", key) for key in causes}
        cells |= {key: share_over_sources(rows, sources, name, key, ALL) for key in _OF_ESTIMATORS}
        if name == MONTE_CARLO:
            cells["agreement"] = None  # with itself
        table.add_row(labels, cells)
    table.compare_down([ALL], same=1)
    return table.build(
        caption="Accuracy (%) with each estimator in place of Monte-Carlo" + stand_in_clause(sources.values()),
        column_head="metric",
        columns={key: Column(key.capitalize()) for key in causes} | _OF_ESTIMATORS,
        footnotes=(
            f"Shares of {_samples(table, ALL)}, {_of_concepts(table)} of each concept. {_INTERVAL} Bold: best of an "
            "explainer.",
            "The uncertainty is how far the covariance diverges from that of the untouched pair, as in Table I. As "
            "with Monte-Carlo: share of the samples with the same answer.",
            "Abstained: all concepts have the same value. No estimate: the estimator failed or refused under at least "
            "one condition, and the sample counts as wrong.",
        ),
    )


def table14_method_matrix(
    metrics: pd.DataFrame,
    sources: Mapping[str, Mapping],
    explainers: Mapping[str, str],
    methods: Mapping[str, str],
    left_out: Mapping[str, str],
) -> Table:
    """Return the accuracy of explainers × the method learned from, by that of the test registrations.

    Args:
        left_out: The package that is missing, by the title of the method that needs it.
    """
    table = TableBuilder("table14_method_matrix", {"explainer": "Explainer", "learnt_from": "Learned from"})
    names = [*methods, ANOTHER]
    for (explainer, learned_from), labels in crossed(explainers, methods):
        rows = rows_where(metrics, table=explainer)
        cells = {name: share_over_sources(rows, sources, name, "accuracy", learned_from) for name in names}
        table.add_row(labels, cells)
    table.compare_down(methods, same=1)
    columns = {name: Column(f"on {title}") for name, title in methods.items()} | {
        ANOTHER: Column("on another (mean)", interval=False)  # the same samples several times
    }
    shown = {key for _, key in table.cells}
    return table.build(
        caption="Accuracy (%) from each registration method to each other" + stand_in_clause(sources.values()),
        column_head="asked_of",
        columns={name: column for name, column in columns.items() if name in shown},
        footnotes=(
            f"Shares of {_samples(table, next(iter(methods)))}. {_INTERVAL} Bold: best on a method.",
            "The explainer learns from registrations by one method and explains the same test pairs as registered by "
            "another; the encoder is the run's own, which has seen point-to-point alone.",
            *_failed(metrics, table, sources, methods),
            *missing_packages(left_out),
        ),
    )


def _samples(table: TableBuilder, column: str) -> str:
    """Return how many test samples the first row's cell in a column has, in words."""
    cell = table.first_cell(column)
    return f"{cell.test_samples} test samples, of {plural(cell.seeds, 'seed')} and all datasets together"


def _of_concepts(table: TableBuilder) -> str:
    return span(cell.test_samples for (row, key), cell in table.cells.items() if row == 0 and key in CONCEPTS)


def _failed(
    metrics: pd.DataFrame, table: TableBuilder, sources: Mapping[str, Mapping], methods: Mapping[str, str]
) -> list[str]:
    explainer, learned_from = (key for key, _ in table.rows[0])
    rows = rows_where(metrics, table=explainer)
    shares = {title: share_over_sources(rows, sources, name, "failed", learned_from) for name, title in methods.items()}
    failed = ", ".join(f"{title} {cell.mean:.1f} %" for title, cell in shares.items() if cell)
    return [f"Registrations that failed by the method's own account, which are explained like any other: {failed}."]
