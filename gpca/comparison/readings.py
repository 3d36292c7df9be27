"""The printed numbers beside the values that every reading gives in their place (docs/comparison.md)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from gpca.comparison.closeness import exactly
from gpca.comparison.published import Counterpart, Number
from gpca.comparison.values import Reproduced, value_of_run
from gpca.comparison.verdicts import (
    CLOSE,
    NOT_COMPARABLE,
    NOT_REPRODUCED,
    REPRODUCED,
    Tolerance,
    distance,
    verdict_of,
)
from gpca.io.csv_file import numbers as numbers_in
from gpca.io.csv_file import read_csv

if TYPE_CHECKING:
    import pandas as pd

READINGS = "readings.csv"
OF_GROUP = ["table", "row", "column", "group"]  # what the readings of one group for one number share
READING_COLUMNS = (
    *("table", "row", "column", "unit", "published", "upper", "reproduced", "verdict"),
    *("group", "reading", "value", "at_least", "n", "distance", "close", "chance"),
)


def judge_readings(
    numbers: Sequence[Number], comparison: pd.DataFrame, readings: pd.DataFrame, tolerances: Mapping[str, Tolerance]
) -> pd.DataFrame:
    """Return `READING_COLUMNS`, a row per printed number and reading that has a value in its place.

    Args:
        numbers: the printed numbers.
        comparison: the rows that :func:`gpca.comparison.verdicts.compare` returned for them.
        readings: tidy rows of ``readings.csv``; `table` holds the group and the values of its choices, with / between,
            and the other columns are those of the counterpart in its own file.
        tolerances: of each unit.

    Returns:
        value: of the reading, in the number's unit. distance: of the value from what is printed, in units of what
        counts as close; of a tolerance that is a ratio, by logarithms. close: whether the mean is within it, whatever
        its interval. chance: the share of the span of the group's values that is within the tolerance of one of them.
    """
    import pandas as pd

    own = comparison.set_index(["table", "row", "column"])[["reproduced", "verdict"]]
    parts = dict(iter(readings.groupby("table", sort=False)))
    named = ["source", "method", "concept"]
    holds = {name: set(rows[named].itertuples(index=False, name=None)) for name, rows in parts.items()}
    records = []
    for number in numbers:
        if (counterpart := number.counterpart) is None or len(counterpart.sources) > 1:
            continue
        wanted = (*counterpart.sources, *counterpart.methods, counterpart.concept)
        for name in (name for name in parts if wanted in holds[name]):
            reproduced = _value(number, counterpart, name, parts[name])
            if reproduced is None:
                continue
            group, _, reading = name.partition("/")
            tolerance, printed = tolerances[number.unit], exactly(number)
            records.append(
                (
                    *number.key,
                    number.unit,
                    number.value,
                    number.upper,
                    *own.loc[number.key],
                    group,
                    reading,
                    round(reproduced.value, 6),
                    reproduced.at_least,
                    reproduced.n,
                    round(distance(printed, reproduced.value, tolerance), 6),
                    verdict_of(printed, _exact(reproduced), tolerance) in (REPRODUCED, CLOSE),
                )
            )
    judged = pd.DataFrame(records, columns=list(READING_COLUMNS[:-1]))
    chances = {
        key: chance_of(rows.loc[~rows["at_least"], "value"], rows["value"], tolerances[rows["unit"].iloc[0]])
        for key, rows in judged.groupby(OF_GROUP, sort=False)
    }
    return judged.assign(chance=[chances[key] for key in judged[OF_GROUP].itertuples(index=False, name=None)])


def chance_of(values: Sequence[float], span: Sequence[float], tolerance: Tolerance) -> float:
    """Return the chance that a number drawn from the readings' span, whatever the paper did, has a close reading.

    It is |∪_r [v_r - c, v_r + c] ∩ [v_min, v_max]| / (v_max - v_min), by logarithms of a tolerance that is a ratio,
    where c is the close tolerance. Of a span of no width it is 1.

    Args:
        values: those of the readings that may be close; lower bounds cannot.
        span: those of all readings.
        tolerance: of their unit.
    """
    scale = math.log if tolerance.factor else float
    # Nothing has no logarithm; it is as far from all else as a hundredth of the least.
    least_positive = min((value for value in span if value > 0), default=1.0)
    floor = least_positive / 100 if tolerance.factor else -math.inf
    scaled, inside = (sorted(scale(max(float(value), floor)) for value in part) for part in (span, values))
    least, most, close = scaled[0], scaled[-1], scale(tolerance.close)
    if most == least:
        return 1.0 if inside else 0.0
    covered, end = 0.0, least
    for value in inside:
        start, stop = max(value - close, end), min(value + close, most)
        covered += max(stop - start, 0.0)
        end = max(end, stop)
    return round(covered / (most - least), 6)


@dataclass(frozen=True)
class OfGroup:
    """A summary of the values that the readings of one group give for one number.

    Attributes:
        readings: how many there are. close: how many of them are close to what is printed.
        least, most: of their values.
        nearest, value: the reading that is nearest, and what it gives.
        chance: of having a close reading by chance alone, as :func:`chance_of` defines it.
        joint, fitted, touched: the reading of the group that is close to the most of its numbers, to how many, and of
            how many.
    """

    readings: int
    close: int
    least: float
    most: float
    nearest: str
    value: float
    chance: float
    joint: str
    fitted: int
    touched: int
    inside: bool

    @property
    def where(self) -> str:
        """Where the printed number lies: close to a reading, between readings, or outside of all."""
        return "produced" if self.close else "between" if self.inside else "outside"


class Words(Protocol):
    """Says what readers call the groups of readings and their choices."""

    def group(self, name: str) -> str:
        """Return what a group leaves open."""

    def reading(self, group: str, name: str) -> str:
        """Return the choices of a reading of that group."""


def asked_about(judged: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of numbers that are not reproduced, or not judged because of their objects."""
    return judged[judged["verdict"].isin([NOT_REPRODUCED, NOT_COMPARABLE])]


def summarize(judged: pd.DataFrame) -> dict[tuple[str, str, str], dict[str, OfGroup]]:
    """Return number -> group -> summary of its readings, for the numbers of :func:`asked_about`."""
    joint = {}
    for group, rows in judged.groupby("group", sort=False):
        fitted = rows.groupby("reading", sort=False)["close"].sum()
        touched = len(rows[["table", "row", "column"]].drop_duplicates())
        joint[group] = (str(fitted.idxmax()), int(fitted.max()), touched)
    summaries: dict[tuple[str, str, str], dict[str, OfGroup]] = {}
    by_group = asked_about(judged).groupby(OF_GROUP, sort=False)
    for (table, row, column, group), rows in by_group:
        nearest = rows.loc[rows["distance"].abs().idxmin()]
        least, most = rows["value"].min(), rows["value"].max()
        summaries.setdefault((table, row, column), {})[group] = OfGroup(
            len(rows),
            int(rows["close"].sum()),
            float(least),
            float(most),
            nearest["reading"],
            float(nearest["value"]),
            float(nearest["chance"]),
            *joint[group],
            inside=bool(least <= nearest["upper"] and most >= nearest["published"]),
        )
    return summaries


def sentence(groups: Mapping[str, OfGroup], words: Words) -> str:
    """Return the sentences of a reason about the readings, one for each group."""
    sentences = []
    for name, of in groups.items():
        group = words.group(name)
        span, nearest = f"{of.least:.3g} to {of.most:.3g}", f"{of.value:.3g} ({words.reading(name, of.nearest)})"
        if of.close:
            by_chance = f"{of.chance:.0%} of their span is, so that this may be chance"
            sentences.append(
                f"{group}: {of.close} of {of.readings} readings are close, the nearest gives {nearest}; {by_chance}."
            )
        elif of.inside:
            sentences.append(
                f"{group}: none of {of.readings} readings is close; they give {span}, the nearest {nearest}."
            )
        else:
            sentences.append(f"{group}: outside of all {of.readings} readings, which give {span}.")
    return " ".join(sentences)


def with_readings(comparison: pd.DataFrame, judged: pd.DataFrame, words: Words) -> pd.DataFrame:
    """Return the comparison in which the reasons of misses say, in words, what the readings give."""
    summaries = summarize(judged[judged["verdict"] == NOT_REPRODUCED])
    reasons = [
        f"{reason} {sentence(summaries[key], words)}" if key in summaries else reason
        for *key, reason in comparison[["table", "row", "column", "reason"]].itertuples(index=False)
        for key in [tuple(key)]
    ]
    return comparison.assign(reason=reasons)


def read_judged(path: str | Path) -> pd.DataFrame:
    """Read the rows that :func:`judge_readings` returned.

    Raises:
        InputError: missing, empty or unreadable file, missing column, something that is not a number.
    """
    rows = read_csv(path, READING_COLUMNS)
    for column in ("published", "upper", "value", "n", "chance"):
        rows[column] = numbers_in(path, rows, column)
    rows["distance"] = numbers_in(path, rows, "distance", needed=rows["distance"] != "-inf")  # of 0, by a ratio
    rows["reproduced"] = numbers_in(path, rows, "reproduced", needed=rows["reproduced"] != "")
    for column in ("close", "at_least"):
        rows[column] = rows[column] == "True"
    return rows


def _value(number: Number, counterpart: Counterpart, name: str, rows: pd.DataFrame) -> Reproduced | None:
    there = replace(counterpart, file=READINGS, table=name)
    return value_of_run(replace(number, counterpart=there), {READINGS: rows})


def _exact(reproduced: Reproduced) -> Reproduced:
    """Return the value as if its interval were none; a few seeds have too wide a one to tell readings apart."""
    return Reproduced(reproduced.value, reproduced.value, reproduced.value, reproduced.n, reproduced.at_least)
