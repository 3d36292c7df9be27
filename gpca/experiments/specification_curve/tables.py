"""The numbers of the paper that are missed, with the values that every reading gives in their place."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gpca.comparison.readings import summarize
from gpca.experiments.specification_curve.words import reading_in_words
from gpca.objects.title import stand_in_clause
from gpca.reporting.tables.builder import TableBuilder
from gpca.reporting.tables.cells import plain_cell, rows_where
from gpca.reporting.tables.table import Cell, Column, Table

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = {"published": "Paper", "reproduced": "Here", "least": "Least", "most": "Most", "value": "Nearest"}
_BEST = "Reading that is close to the most numbers"


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
            numbers |= {"least": of.least, "most": of.most, "value": of.value}
            cells = {name: None if math.isnan(x) else plain_cell(float(x), seeds, 0) for name, x in numbers.items()}
            table.add_row(labels, cells)
    return table.build(
        "The numbers that are not reproduced, under other readings of what the paper leaves unstated"
        + stand_in_clause(sources.values()),
        "value",
        {name: Plain(title, interval=False, limits=(-math.inf, math.inf)) for name, title in COLUMNS.items()},
        (
            "Paper to Nearest are in the row's unit; Least, Most and Nearest are means over the seeds of single "
            "readings. Of a range, Paper is the lower end. No reading is the reproduction.",
            f"{_BEST}: of all printed numbers that the same choices touch, also those that are reproduced; in brackets "
            "to how many of how many it is close.",
        ),
    )
