"""Finds the joint reading with the largest share of close numbers, and how large the largest would be by chance.

Values of development samples, part by part, become arrays with an axis for every choice, of length 1 where a number
does not depend on it; so the share of every joint reading is a sum of these arrays, and so it is for every deal of the
printed numbers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.active_learning.curves import CENSORED_BY
from gpca.comparison.chance import WITHIN, is_close, permuted, weights
from gpca.comparison.published import UNITS, Number
from gpca.comparison.verdicts import Tolerance
from gpca.errors import InputError
from gpca.experiments.joint_reading.choices import CHOICES, PARTS, Joint, text_of

if TYPE_CHECKING:
    import pandas as pd

TABLES = ("I", "II", "III", "IV", "V")


@dataclass(frozen=True)
class Found:
    """What a search found.

    Attributes:
        joint: the first of the readings with the largest share, in the order of the grid.
        share: that share, between 0 and 1.
        close: (K,) which numbers are close under it.
        best: the readings with the largest shares, first to last, each with its share.
        equals: how many readings have the largest share.
        readings: how many there are.
        protocol: the share of the grid's first reading, in which every choice has the protocol's value.
        by_chance: way of dealing -> (D,) the largest share in each deal of the printed numbers.
    """

    joint: Joint
    share: float
    close: np.ndarray
    best: list[tuple[Joint, float]]
    equals: int
    readings: int
    protocol: float
    by_chance: Mapping[str, np.ndarray]

    def counts(self) -> dict[str, float]:
        """Return the numbers of readings, of all and of those with the largest share, and the first one's share."""
        return {"readings": self.readings, "equals": self.equals, "share_of_protocol": self.protocol}


def asked(numbers: Sequence[Number], sources: Sequence[str] | None = None) -> list[Number]:
    """Return the means of Tables I to V, each value of ours once; of these sources alone, if any are given."""
    return [
        number
        for number in numbers
        if number.table in TABLES
        and number.counterpart
        and number.counterpart.statistic == "mean"
        and not number.same_as
        and (sources is None or set(number.counterpart.sources) <= set(sources))
    ]


def search(
    numbers: Sequence[Number],
    printed: Sequence[Number],
    measured: pd.DataFrame,
    grid: Mapping[str, Sequence[Any]],
    tolerances: Mapping[str, Tolerance],
    deals: int,
    shown: int = 20,
) -> Found:
    """Search every joint reading of a grid.

    Args:
        numbers: those that are asked about.
        printed: these and others, whose printed values come into their places by chance.
        measured: tidy rows of one source that stands for theirs, with `table` as :func:`part_name` has it.
        grid: the values of every choice, the protocol's first.
        tolerances: of each unit.
        deals: of the printed numbers, for the chance.
        shown: how many readings `best` has.

    Raises:
        InputError: a number without values, or a value that the grid needs and the rows lack.
    """
    shape = tuple(len(grid[choice]) for choice in CHOICES)
    closes = [_closes(number, printed, measured, grid, tolerances) for number in numbers]
    weight_K = weights(numbers)
    place_K = np.array([printed.index(number) for number in numbers])
    share_G = _shares(closes, place_K, weight_K, shape)
    order = np.argsort(-np.round(share_G.ravel(), 9), kind="stable")
    joints = [_joint(grid, np.unravel_index(place, shape)) for place in order[:shown]]
    largest = float(share_G.ravel()[order[0]])
    best_at = np.unravel_index(order[0], shape)
    close_K = [
        bool(np.broadcast_to(close[place], shape)[best_at]) for close, place in zip(closes, place_K, strict=True)
    ]
    by_chance = {
        within: np.array(
            [_shares(closes, dealt_P[place_K], weight_K, shape).max() for dealt_P in permuted(printed, within, deals)]
        )
        for within in WITHIN
    }
    return Found(
        joints[0],
        largest,
        np.array(close_K),
        [(joint, float(share_G.ravel()[place])) for joint, place in zip(joints, order, strict=False)],
        int((share_G >= largest - 1e-9).sum()),
        share_G.size,
        float(share_G.ravel()[0]),
        by_chance,
    )


def values_of(number: Number, measured: pd.DataFrame) -> dict[str, tuple[float, bool]]:
    """Return name of a part -> mean over the seeds in the number's unit, and whether some of it is a lower bound."""
    counterpart = number.counterpart
    assert counterpart
    [method], [metric] = counterpart.methods, counterpart.metrics
    rows = measured[(measured["method"] == method) & (measured["concept"] == counterpart.concept)]
    means = rows[rows["metric"] == metric].groupby("table", sort=False)["value"].mean()
    reached = rows[rows["metric"] == CENSORED_BY.get(metric)].groupby("table")["value"].min()
    factor = UNITS[number.unit].factor
    return {name: (factor * value, bool(reached.get(name, 1) < 1)) for name, value in means.items()}


def _closes(
    number: Number,
    printed: Sequence[Number],
    measured: pd.DataFrame,
    grid: Mapping[str, Sequence[Any]],
    tolerances: Mapping[str, Tolerance],
) -> np.ndarray:
    """Return (P, …): whether a number's values are close to each printed one, with an axis for every choice.

    To printed numbers that never come into its place nothing is close.
    """
    known = values_of(number, measured)
    if not known:
        raise InputError("joint reading", f"has no value of {' / '.join(number.key)}", "measure it again")
    part = next(iter(known)).partition("/")[0]
    shape = [len(grid[choice]) if choice in PARTS[part] else 1 for choice in CHOICES]
    close = np.zeros((len(printed), *shape), dtype=bool)
    comparable = [other for other, of in enumerate(printed) if (of.table, of.unit) == (number.table, number.unit)]
    for at in product(*map(range, shape)):
        name = "/".join([part, *(text_of(grid[c][at[list(CHOICES).index(c)]]) for c in PARTS[part])])
        if name not in known:
            raise InputError("joint reading", f"has no value of {' / '.join(number.key)} under {name}", "measure it")
        value, at_least = known[name]
        for other in comparable:
            close[(other, *at)] = is_close(printed[other], value, at_least, tolerances[number.unit])
    return close


def _shares(
    closes: Sequence[np.ndarray], dealt_K: np.ndarray, weight_K: np.ndarray, shape: tuple[int, ...]
) -> np.ndarray:
    """Return the share of every joint reading, where other printed numbers stand in the places of the numbers.

    Numbers that depend on the same choices are added up before the whole grid is.
    """
    of_shapes: dict[tuple[int, ...], np.ndarray] = {}
    for place, close in enumerate(closes):
        own = weight_K[place] * close[dealt_K[place]]
        of_shapes[own.shape] = of_shapes.get(own.shape, 0) + own
    share_G = np.zeros(shape)
    for part in of_shapes.values():
        share_G += part
    return share_G


def _joint(grid: Mapping[str, Sequence[Any]], at: Sequence[np.intp]) -> Joint:
    return {choice: grid[choice][int(place)] for choice, place in zip(CHOICES, at, strict=True)}
