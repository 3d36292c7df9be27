"""Which readings of what the paper leaves open give a value close to each printed number (docs/comparison.md)."""

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from gpca.comparison.published import Number
from gpca.comparison.values import value_of_run
from gpca.comparison.verdicts import NOT_COMPARABLE, NOT_REPRODUCED, Tolerance, distance
from gpca.io import csv_file
from gpca.io.csv_file import read_csv
from gpca.io.frame import Frame

READINGS = "readings.csv"
NUMBER = ["table", "row", "column"]
READING_COLUMNS = (
    *("table", "row", "column", "unit", "published", "upper", "reproduced", "verdict"),
    *("group", "reading", "value", "at_least", "n", "distance", "close", "chance"),
)


def judge_readings(
    numbers: Sequence[Number], comparison: Frame, readings: Frame, tolerances: Mapping[str, Tolerance]
) -> Frame:
    """Return `READING_COLUMNS`, a row per printed number and reading that has a value in its place."""
    import pandas as pd

    judged = comparison.set_index(NUMBER)[["reproduced", "verdict"]]
    rows_by_place: dict[tuple, dict[str, Frame]] = defaultdict(dict)  # source, method and concept -> table -> rows
    for (name, *place), rows in readings.groupby(["table", "source", "method", "concept"], sort=False):
        rows_by_place[tuple(place)][name] = rows
    records = []
    for number in numbers:
        if (counterpart := number.counterpart) is None:
            continue
        shared = (*number.key, number.unit, number.value, number.upper, *judged.loc[number.key])
        place = (*counterpart.sources, *counterpart.methods, counterpart.concept)
        for name, rows in rows_by_place[place].items():
            there = replace(number, counterpart=replace(counterpart, file=READINGS, table=name))
            if (reproduced := value_of_run(there, {READINGS: rows})) is None:
                continue
            group, _, reading = name.partition("/")
            apart = distance(number, reproduced.value, tolerances[number.unit])
            close = not reproduced.at_least and abs(apart) <= 1
            measured = (round(reproduced.value, 6), reproduced.at_least, reproduced.n, round(apart, 6), close)
            records.append((*shared, group, reading, *measured))
    rows = pd.DataFrame(records, columns=list(READING_COLUMNS[:-1]))
    chances = {
        key: chance_of(part.loc[~part["at_least"], "value"], part["value"], tolerances[part["unit"].iloc[0]])
        for key, part in rows.groupby([*NUMBER, "group"], sort=False)
    }
    return rows.assign(chance=[chances[key] for key in rows[[*NUMBER, "group"]].itertuples(index=False, name=None)])


def chance_of(values: Sequence[float], span: Sequence[float], tolerance: Tolerance) -> float:
    """Return the chance that a number drawn uniformly from the readings' span has a close reading.

    It is |∪_r [v_r - c, v_r + c] ∩ [v_min, v_max]| / (v_max - v_min), where c is the close tolerance, in logarithms for
    a ratio; 1 for a span of no width. The values of readings that are lower bounds are in the span alone.
    """
    scale = math.log if tolerance.factor else float
    # Zero has no logarithm, and counts as a hundredth of the smallest positive value.
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


class GroupSummary(NamedTuple):
    """The values that the readings of one group give for one number."""

    readings: int
    close: int  # readings whose value is close to the printed number
    least: float  # value, to the most
    most: float
    nearest: str  # reading, and its value
    value: float
    chance: float  # of having a close reading, as :func:`chance_of` defines it
    joint: str  # the group's reading that is close to the most of the `touched` numbers, to `fitted`
    fitted: int
    touched: int
    inside: bool  # the range holds the printed number

    @property
    def where(self) -> str:
        """Where the printed number lies: close to a reading, between readings, or outside of all."""
        return "produced" if self.close else "between" if self.inside else "outside"


def unresolved(judged: Frame) -> Frame:
    """Return the rows of numbers that are not reproduced, or not comparable because of their objects."""
    return judged[judged["verdict"].isin([NOT_REPRODUCED, NOT_COMPARABLE])]


def summarize(judged: Frame) -> dict[tuple[str, str, str], dict[str, GroupSummary]]:
    """Return number -> group -> summary of its readings, for the numbers of :func:`unresolved`."""
    joint = {}
    for group, rows in judged.groupby("group", sort=False):
        fitted = rows.groupby("reading", sort=False)["close"].sum()
        joint[group] = (str(fitted.idxmax()), int(fitted.max()), len(rows[NUMBER].drop_duplicates()))
    summaries: dict[tuple[str, str, str], dict[str, GroupSummary]] = {}
    for (table, row, column, group), rows in unresolved(judged).groupby([*NUMBER, "group"], sort=False):
        nearest = rows.loc[rows["distance"].abs().idxmin()]
        least, most = rows["value"].min(), rows["value"].max()
        summaries.setdefault((table, row, column), {})[group] = GroupSummary(
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


def sentence(groups: Mapping[str, GroupSummary], words: ModuleType) -> str:
    sentences = []
    for name, of in groups.items():
        span, nearest = f"{of.least:.3g} to {of.most:.3g}", f"{of.value:.3g} ({words.reading(name, of.nearest)})"
        text = f"outside of all {of.readings} readings, which give {span}."
        if of.close:
            text = f"{of.close} of {of.readings} readings are close, the nearest gives {nearest}; {of.chance:.0%} of "
            text += "their span is, so that this may be chance."
        elif of.inside:
            text = f"none of {of.readings} readings is close; they give {span}, the nearest {nearest}."
        sentences.append(f"{words.group(name)}: {text}")
    return " ".join(sentences)


def with_readings(comparison: Frame, judged: Frame, words: ModuleType) -> Frame:
    """Return the comparison with the readings' values in the reasons of misses."""
    summaries = summarize(judged[judged["verdict"] == NOT_REPRODUCED])
    reasons = [
        f"{reason} {sentence(summaries[tuple(key)], words)}" if tuple(key) in summaries else reason
        for *key, reason in comparison[[*NUMBER, "reason"]].itertuples(index=False)
    ]
    return comparison.assign(reason=reasons)


def read_judged(path: str | Path) -> Frame:
    rows = read_csv(path, READING_COLUMNS)
    needed = {"distance": rows["distance"] != "-inf", "reproduced": rows["reproduced"] != ""}  # -inf: ratio of zero
    for column in ("published", "upper", "value", "n", "chance", "distance", "reproduced"):
        rows[column] = csv_file.numbers(path, rows, column, needed=needed.get(column, True))
    return rows.assign(**{column: rows[column] == "True" for column in ("close", "at_least")})
