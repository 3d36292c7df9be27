"""Answers the paper's two claims about the GPC: that it is as accurate as its rivals, and tracks shift better."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from gpca.explainers.gpca import GPCA_FORMS
from gpca.objects.title import title_of
from gpca.reporting.tables.builder import TableBuilder, cell_of_repeats
from gpca.reporting.tables.diagnostics import (
    NOTHING,
    OF_DISTANCE,
    RHO,
    SHIFTED,
    only,
    printed_scale,
    repeats_note,
    samples_of_seed,
    values_by_seed,
)
from gpca.reporting.tables.table import EMPTY, Cell, Column, Table
from gpca.shift.metrics import with_training_like

if TYPE_CHECKING:
    import pandas as pd

RIVALS = ("learner_forest", "learner_linear_svm")  # The paper compares the GPC with these two.


def table5_claims(metrics: pd.DataFrame, sources: Mapping[str, Mapping], learners: Mapping[str, str]) -> Table:
    """Return the answers to both claims, with the differences paired by seed.

    The arguments and the error are those of :mod:`gpca.reporting.tables.learners`.
    """
    sets = {"accuracy": ["in_distribution"], "rho": [with_training_like(name) for name in SHIFTED]}
    metrics = only(metrics, ["accuracy", RHO])
    table = TableBuilder(
        "table5_claims",
        {
            "source": "Dataset",
            "learner": "GPC",
            "rival": "Rival",
            "accurate": "As accurate or more",
            "tracks": "Tracks shift better",
        },
    )
    for source, entry in sources.items():
        for own in (name for name in GPCA_FORMS if name in learners):
            for rival in (name for name in RIVALS if name in learners):
                accuracy = _paired(metrics, source, sets["accuracy"], "accuracy", own, rival)
                rho = _paired(metrics, source, sets["rho"], RHO, own, rival)
                accurate = _answer(accuracy, may_be_equal=True)
                tracks = _answer(rho, may_be_equal=False)
                table.add_row(
                    [
                        (source, title_of(entry)),
                        (own, learners[own]),
                        (rival, learners[rival]),
                        (accurate, accurate),
                        (tracks, tracks),
                    ],
                    {"accuracy": accuracy, "rho": rho},
                )
    table.require_rows(*NOTHING)
    return table.build(
        caption="Whether the GPC is as accurate as forest and SVM and tracks distributional shift better"
        + table.stand_in_clause(sources),
        column_head="difference",
        columns={
            "accuracy": Column("Accuracy (%)", limits=(-100, 100)),
            "rho": Column("ρ", decimals=3, limits=(-2, 2)),
        },
        footnotes=(
            repeats_note(table, metrics),
            "GPC minus rival, paired by seed. As accurate or more: yes unless the whole interval lies below zero. "
            f"Tracks shift better: yes only where the whole interval lies above zero. {EMPTY}: one seed, no interval.",
            f"{OF_DISTANCE} Here it is the mean over the three kinds of shift of table5_shift.",
        ),
    )


def _paired(metrics: pd.DataFrame, source: str, sets: list[str], metric: str, own: str, rival: str) -> Cell | None:
    """Return the difference of two learners, the mean over the sets of which both have the metric, then over seeds."""
    kept: dict[str, pd.Series] = {}
    for of_set in sets:
        of_own = values_by_seed(metrics, source, own, of_set, metric)
        difference = (of_own - values_by_seed(metrics, source, rival, of_set, metric)).dropna()
        if len(difference):
            kept[of_set] = difference
    if not kept:
        return None
    of_seed = sum(kept.values()) / len(kept) * printed_scale(metric)
    samples = sum(samples_of_seed(metrics, source, of_set) for of_set in kept)
    return cell_of_repeats(of_seed, samples * len(of_seed))


def _answer(cell: Cell | None, may_be_equal: bool) -> str:
    """Return whether a difference is positive, or at least not negative where it may be zero."""
    if cell is None or cell.seeds == 1:
        return EMPTY
    if may_be_equal:
        return "yes" if cell.mean + cell.half_width >= 0 else "no"
    return "yes" if cell.mean - cell.half_width > 0 else "no"
