"""Makes the tables of readings: the missed numbers under each, and depth frames by the cloud that the encoder sees."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gpca.comparison.readings import summarize
from gpca.evaluation.measures import ALL
from gpca.experiments.frames import encoder_title
from gpca.experiments.specification_curve.registry import FRAME_INPUT
from gpca.experiments.specification_curve.words import reading_in_words
from gpca.objects.entry import stand_in_clause
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.builder import TableBuilder, crossed, interval_over
from gpca.reporting.tables.cells import cell_of_repeats, plain_cell, rows_where
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = {"published": "Paper", "reproduced": "Here", "least": "Least", "most": "Most", "value": "Nearest"}
CHANCE = "chance"
_BEST = "Reading that is close to the most numbers"
INPUTS = {
    "aligned": "observed cloud, aligned by ICP",
    "observed": "observed cloud before ICP",
    "reversed": "observed cloud, ICP from the model to it",
}
OBJECTS = {"all": "All (%)", "seen": "Seen objects (%)", "unseen": "Unseen objects (%)"}
CONFUSED = {"pose": "overlap", "overlap": "pose"}


@dataclass(frozen=True)
class Plain(Column):
    """Shows a number with three digits, whatever its unit."""

    def text(self, cell: Cell) -> str:
        """Return e.g. ``0.592``."""
        return f"{cell.mean:.3g}"


def table13_readings(judged: pd.DataFrame, groups: Mapping[str, str], sources: Mapping[str, Mapping]) -> Table:
    """Return a row per missed number and group of readings that touches it; of stand-ins, per number that is touched.

    Args:
        judged: as :func:`gpca.comparison.readings.read_judged` reads it.
    """
    heads = {"number": "Number", "unit": "Unit", "group": "What is open", "where": "Printed number"}
    heads |= {"nearest": "Nearest reading", "close": "Readings that are close", "joint": _BEST}
    table = TableBuilder("table13_readings", heads)
    for key, of_groups in summarize(judged).items():
        rows = rows_where(judged, **dict(zip(("table", "row", "column"), key, strict=True)))
        first = rows.iloc[0]
        for group, of in of_groups.items():
            seeds = int(rows.loc[rows["group"] == group, "n"].max())
            labels = (
                (" / ".join(key), ", ".join(key)),
                (first["unit"], first["unit"]),
                (group, groups.get(group, group)),
                (of.where, of.where),
                (of.nearest, reading_in_words(group, of.nearest)),
                (f"{of.close}/{of.readings}", f"{of.close} of {of.readings}"),
                (of.joint, f"{reading_in_words(group, of.joint)} ({of.fitted} of {of.touched})"),
            )
            numbers = {"published": first["published"], "reproduced": first["reproduced"]}
            numbers |= {"least": of.least, "most": of.most, "value": of.value, CHANCE: 100 * of.chance}
            cells = {name: None if math.isnan(x) else plain_cell(float(x), seeds, 0) for name, x in numbers.items()}
            table.add_row(labels, cells)
    return table.build(
        "The numbers that are not reproduced, under other readings of what the paper leaves unstated"
        + stand_in_clause(sources.values()),
        "value",
        {
            **{name: Plain(title, interval=False, limits=(-math.inf, math.inf)) for name, title in COLUMNS.items()},
            CHANCE: Column("Chance (%)", decimals=0, interval=False),
        },
        (
            "Chance: the share of the span of a group's values, from Least to Most, that is close to one of its "
            "readings: how likely a number from anywhere in it would be produced (docs/comparison.md). "
            f"{_by_chance(judged)}",
            "Paper to Nearest are in the row's unit; Least, Most and Nearest are means over the seeds of single "
            "readings. Of a range, Paper is the lower end. No reading is the reproduction.",
            f"{_BEST}: of all printed numbers that the same choices touch, also those that are reproduced; in brackets "
            "to how many of how many it is close.",
        ),
    )


def _by_chance(judged: pd.DataFrame) -> str:
    """Return how many numbers are produced by some group, beside how many would be by chance, groups taken apart."""
    of_groups = [of for groups in summarize(judged).values() for of in groups.values()]
    produced, expected = sum(of.close > 0 for of in of_groups), sum(of.chance for of in of_groups if of.inside)
    inside = sum(of.inside for of in of_groups)
    return (
        f"Of the {len(of_groups)} rows, {inside} lie within the span of their group; {expected:.1f} of these would be "
        f"produced by chance. Produced are {produced}, also by readings beside the span."
    )


def table6_inputs(metrics: pd.DataFrame, title: str) -> Table:
    """Return the accuracy on depth frames by the cloud that the encoder sees.

    Args:
        metrics: The tidy rows of the readings ``frame_input``.
    """
    methods = {method: encoder_title(*method.split("-")) for method in metrics["method"].unique()}
    table = TableBuilder("table6_inputs", {"backbone": "Backbone", "input": "The encoder sees"})
    for (method, cloud), labels in crossed(methods, INPUTS):
        of = {name: rows_where(metrics, table=f"{FRAME_INPUT}/{cloud}/{name}", method=method) for name in OBJECTS}
        cells = {name: _share(rows) for name, rows in of.items()}
        cells |= {concept: _share(of["all"], concept=concept) for concept in CONCEPTS}
        cells |= {f"{one}_as_{other}": _taken(of["all"], one, other) for one, other in CONFUSED.items()}
        table.add_row(labels, cells)
    table.compare_down(OBJECTS, same=1)
    columns = {name: Column(head) for name, head in OBJECTS.items()}
    columns |= {concept: Column(f"{concept.capitalize()} (%)", interval=False) for concept in CONCEPTS}
    columns |= {
        f"{one}_as_{other}": Column(f"{one.capitalize()} taken for {other} (%)", interval=False)
        for one, other in CONFUSED.items()
    }
    of_first = {name: table.cells[0, name].test_samples for name in OBJECTS if (0, name) in table.cells}
    counts = ", ".join(f"{name} {count}" for name, count in of_first.items())
    seeds = table.most_seeds()
    return table.build(
        caption=f"Accuracy (%) on {title} by the cloud that the encoder sees",
        column_head="samples",
        columns=columns,
        footnotes=(
            f"Mean over {plural(seeds, 'seed')}, the first of the run; {interval_over(seeds)}. Test samples: {counts}. "
            "The share of seen objects differs from seed to seed, so that All need not lie between Seen and Unseen.",
            "Each cloud has an encoder of its own, pretrained and trained as that of the first row, which is Table "
            "VI's, on the same samples.",
        ),
    )


def _share(rows: pd.DataFrame, metric: str = "accuracy", concept: str = ALL) -> Cell | None:
    value_R = rows_where(rows, metric=metric, concept=concept).sort_values("seed")["value"].to_numpy()
    counted = rows_where(rows, metric="test_samples", concept=concept)["value"]
    return cell_of_repeats(100 * value_R, int(counted.sum()))


def _taken(rows: pd.DataFrame, one: str, other: str) -> Cell | None:
    taken_R, samples_R = (
        rows_where(rows, metric=metric, concept=one).sort_values("seed")["value"].to_numpy(float)
        for metric in (f"predicted_as_{other}", "test_samples")
    )
    return cell_of_repeats(100 * np.divide(taken_R, samples_R), int(samples_R.sum()))
