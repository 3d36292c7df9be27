"""What one reading of all tables gives in the place of each printed number, and whether any reading is close to it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.comparison.chance import is_close
from gpca.comparison.published import Number
from gpca.comparison.verdicts import Tolerance
from gpca.errors import InputError
from gpca.experiments.joint_reading.choices import CHOICES
from gpca.experiments.joint_reading.search import values_of
from gpca.experiments.joint_reading.tally import EVALUATED, JUDGED, Record, scored
from gpca.io.csv_file import numbers as numbers_in
from gpca.io.csv_file import read_csv

if TYPE_CHECKING:
    import pandas as pd

VERDICT_COLUMNS = (
    *("table", "row", "column", "unit", "published", "upper", "reproduced", "at_least", "close"),
    *("joint", "joint_at_least", "joint_close", "n", "readings", "readings_close"),
)
FLAGS = ("at_least", "close", "joint_at_least", "joint_close")


def judge(
    numbers: Sequence[Number],
    joint: pd.DataFrame,
    comparison: pd.DataFrame,
    readings: pd.DataFrame,
    tolerances: Mapping[str, Tolerance],
    deals: int,
) -> tuple[list[tuple], list[Record]]:
    """Return a row of `VERDICT_COLUMNS` for each number, and the scores of the joint reading and of the protocol.

    Args:
        numbers: those that are judged.
        joint: tidy rows of the joint reading.
        comparison: text of the run's comparison: `reproduced`, `at_least`.
        readings: as :func:`gpca.comparison.readings.read_judged` reads them.
        tolerances: of each unit.
        deals: of the printed numbers, for the chance.

    Raises:
        InputError: a number without a value of the joint reading.
    """
    of_run = comparison.set_index(["table", "row", "column"])[["reproduced", "at_least"]]
    of_readings = readings.groupby(["table", "row", "column"])["close"].agg(["size", "sum"])
    rows, values, own_values = [], [], []
    for number in numbers:
        tolerance, value = tolerances[number.unit], _value(number, joint)
        reproduced, at_least = of_run.loc[number.key]
        own = (float(reproduced or "nan"), at_least == "True")  # empty where the run has no such value
        known = number.key in of_readings.index
        counts = [int(count) for count in of_readings.loc[number.key]] if known else [0, 0]
        upper = number.upper if number.upper > number.value else math.nan
        seeds = joint.loc[joint["source"].isin(_sources(number)), "seed"].nunique()
        rows.append(
            (
                *(*number.key, number.unit, number.value, upper),
                *(*own, is_close(number, *own, tolerance)),
                *(round(value[0], 6), value[1], is_close(number, *value, tolerance), seeds),
                *counts,
            )
        )
        values.append(value)
        own_values.append(own)
    records = scored(numbers, values, tolerances, deals, EVALUATED)
    return rows, records + scored(numbers, own_values, tolerances, deals, JUDGED)


def read_verdicts(path: str | Path) -> pd.DataFrame:
    """Read the rows that :func:`judge` returned.

    Raises:
        InputError: missing, empty or unreadable file, missing column, something that is not a number.
    """
    rows = read_csv(path, VERDICT_COLUMNS)
    for column in ("published", "joint", "n", "readings", "readings_close"):
        rows[column] = numbers_in(path, rows, column)
    for column in ("upper", "reproduced"):
        rows[column] = numbers_in(path, rows, column, needed=rows[column] != "")
    for column in FLAGS:
        rows[column] = rows[column] == "True"
    return rows


def read_choices(path: str | Path) -> pd.DataFrame:
    """Read the values of the joint reading's choices: `choice`, `value`.

    Raises:
        InputError: missing, empty or unreadable file, missing column, other choices than there are.
    """
    rows = read_csv(path, ("choice", "value"))
    if rows["choice"].tolist() != list(CHOICES):
        raise InputError(path, f"has the choices {', '.join(rows['choice'])}", "make it again")
    return rows


def _value(number: Number, joint: pd.DataFrame) -> tuple[float, bool]:
    """Return the mean over the seeds, in the number's unit, and whether some of them are lower bounds."""
    known = list(values_of(number, joint[joint["source"].isin(_sources(number))]).values())
    if len(known) != 1:
        raise InputError("joint reading", f"has {len(known)} values of {' / '.join(number.key)}", "make it again")
    return known[0]


def _sources(number: Number) -> tuple[str, ...]:
    return number.counterpart.sources if number.counterpart else ()
