"""Makes the parts of Table X on encoders: those that are trained in other ways, and the cost of those of the pair."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import inf
from typing import TYPE_CHECKING

from gpca.evaluation.measures import POOLED
from gpca.experiments.controls.settings import PAPER, SEEN, TRAININGS, TRANSFER, UNSEEN, trained_otherwise
from gpca.experiments.controls.tables import ALL_TOGETHER, BOOTSTRAP, CHANGE, TITLES, change_cell
from gpca.explainers.gpca import GPCA_FORMS
from gpca.objects.entry import stand_in_clause
from gpca.reporting.tables.builder import TableBuilder, crossed, titles_of
from gpca.reporting.tables.cells import cell_of_repeats, interval_cell, plain_cell, rows_where
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import plural, span

if TYPE_CHECKING:
    import pandas as pd

TRAINED = {"random_draws": "draws of random size"}
SAME_SEEDS = "paper_same_seeds"  # the paper's training, over the seeds of the encoders trained in other ways
KNOWN = {PAPER: TITLES[PAPER], SEEN: "Objects that it learned from (%)", UNSEEN: "Unseen objects (%)"}


def table10_encoders(intervals: pd.DataFrame, sources: Mapping[str, Mapping], explainers: Mapping[str, str]) -> Table:
    """Return the accuracy of GP-CA with encoders that are trained in other ways, on known and on unseen objects."""
    table = TableBuilder("table10_encoders", {"source": "Dataset", "training": "Encoder"})
    forms = {name: words for name, words in explainers.items() if name in GPCA_FORMS}
    for (source, explainer), (dataset, (_, words)) in crossed(ALL_TOGETHER | titles_of(sources), forms):
        ways = {way: trained_otherwise(explainer, way) for way in TRAININGS}
        of_ways = {
            way: rows_where(intervals, source=source, method=name, metric="accuracy").set_index("control")
            for way, name in {PAPER: explainer, **ways}.items()
        }
        for way, rows in of_ways.items():
            of_control = {control: rows.loc[control] for control in KNOWN if control in rows.index}
            cells = {control: interval_cell(row) for control, row in of_control.items()}
            if way != PAPER:
                cells |= {control + CHANGE: change_cell(row) for control, row in of_control.items()}
            label = words if way == PAPER else f"{words}, {TRAINED[way]}"
            table.add_row([dataset, (way, _with_seeds(label, of_control.values()))], cells)
            if way == PAPER:
                of_same, same = _on_same_seeds(of_control, [of_ways[other] for other in TRAININGS])
                table.add_row([dataset, (SAME_SEEDS, _with_seeds(words, of_same))], same)
    return table.build(
        caption="Accuracy (%) on encoders that are trained otherwise" + stand_in_clause(sources.values()),
        column_head="objects",
        columns={name: Column(words, interval=False) for name, words in KNOWN.items()}
        | {
            name + CHANGE: Column(f"{words}: change", limits=(-100.0, 100.0), beside=name)
            for name, words in KNOWN.items()
            if name != PAPER
        },
        footnotes=(
            "Except under the paper's protocol, all learn from the same training samples of some of the objects, and "
            "are asked about new samples of these objects and about the others. In brackets: points gained or lost by "
            "the training, on the same seeds and test samples, and " + BOOTSTRAP + ".",
        ),
    )


def _on_same_seeds(
    own: Mapping[str, pd.Series], others: Iterable[pd.DataFrame]
) -> tuple[list[pd.Series], dict[str, Cell | None]]:
    """Return the values of the paper's training over the seeds of the other trainings, where these are fewer.

    It is their own value without their change, which is against it. All trainings have the same seeds.

    Returns:
        the rows that it follows from; the cell of each control.
    """
    of_control = {
        control: rows.loc[control]
        for rows in others
        for control in own
        if control in rows.index and rows.loc[control]["seeds"] < own[control]["seeds"]
    }
    cells: dict[str, Cell | None] = {
        control: plain_cell(100 * (row["value"] - row["change"]), int(row["seeds"]), int(row["samples"]))
        for control, row in of_control.items()
    }
    return list(of_control.values()), cells


def _with_seeds(words: str, rows: Iterable[pd.Series]) -> str:
    seeds = [row["seeds"] for row in rows]
    return f"{words}, {plural(span(seeds), 'seed')}" if seeds else words


def table10_costs(
    intervals: pd.DataFrame, costs: pd.DataFrame, sources: Mapping[str, Mapping], explainers: Mapping[str, str]
) -> Table:
    """Return the cost of explainers that see the registrations themselves, beside their gain.

    Args:
        costs: What :func:`gpca.experiments.controls.costs.collect_costs` returned.
    """
    table = TableBuilder("table10_costs", {"explainer": "Explainer"})
    gains = {name: TITLES[name] for name in (PAPER, UNSEEN, TRANSFER)}
    pooled = POOLED if len(sources) > 1 else next(iter(sources))
    for explainer, words in explainers.items():
        cells: dict[str, Cell | None] = {}
        for metric, factor in (("learning_seconds", 1), ("seconds", 1e3)):
            of_metric = rows_where(costs, method=explainer, metric=metric)
            cells[metric] = cell_of_repeats((of_metric.groupby("seed")["value"].mean() * factor).to_numpy(), 0)
        if cells["seconds"] is None:
            continue
        accuracy = rows_where(intervals, source=pooled, method=explainer, metric="accuracy").set_index("control")
        cells |= {name: interval_cell(accuracy.loc[name]) for name in gains if name in accuracy.index}
        table.add_row([(explainer, words)], cells)
    return table.build(
        caption="What explainers of the pair cost and gain" + stand_in_clause(sources.values()),
        column_head="metric",
        columns={
            "learning_seconds": Column("Learning (s)", interval=False, limits=(0, inf)),
            "seconds": Column("One registration (ms)", interval=False, limits=(0, inf)),
            **{name: Column(words) for name, words in gains.items()},
        },
        footnotes=(
            "Learning: classifier, and encoder if it has its own, from the measured training samples of a source. One "
            "registration: to measure, embed and explain it. Times are means over sources and seeds, on one core; "
            "they differ from run to run.",
            f"In brackets: {BOOTSTRAP}.",
        ),
    )
