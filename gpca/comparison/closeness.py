"""Which of many values are close to which printed numbers, and the share of close ones with each table weighted once.

That share is what joint readings are searched by (docs/comparison.md); its chance is that of printed numbers dealt out
anew, within the unit of a table or within a column.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from gpca.comparison.published import Number
from gpca.comparison.verdicts import Printed, Tolerance, distance
from gpca.seeds import generator

# How printed numbers are dealt out anew: those of one group change places.
WITHIN: Mapping[str, Callable[[Number], tuple[str, ...]]] = {
    "unit": lambda number: (number.table, number.unit),
    "column": lambda number: (number.table, number.column, number.unit),
}


def exactly(number: Number) -> Printed:
    """Return the number as if its sampling left nothing open."""
    return Printed(number.value, number.upper, number.rounding, number.value, number.upper)


def is_close(number: Number, value: float, at_least: bool, tolerance: Tolerance) -> bool:
    """Return whether a value, in the number's unit, lies within the close tolerance; a lower bound never does."""
    return not at_least and abs(distance(exactly(number), value, tolerance)) <= 1


def weights(numbers: Sequence[Number]) -> np.ndarray:
    """Return the weights (K,) of numbers: their sum is 1, each table has the same, and so has each number of one."""
    tables = [number.table for number in numbers]
    return np.array([1 / (len(set(tables)) * tables.count(table)) for table in tables])


def dealt(numbers: Sequence[Number], within: str, deals: int) -> np.ndarray:
    """Return (deals, K): the number whose printed value stands in the place of each, changed within the groups."""
    groups: dict[tuple[str, ...], list[int]] = {}
    for place, number in enumerate(numbers):
        groups.setdefault(WITHIN[within](number), []).append(place)
    dealt_D_K = np.tile(np.arange(len(numbers)), (deals, 1))
    for group, places in groups.items():
        random = generator("printed numbers dealt anew", within, *group)
        dealt_D_K[:, places] = random.permuted(np.tile(places, (deals, 1)), axis=1)
    return dealt_D_K


def p_of(actual: float, by_chance_D: np.ndarray) -> float:
    """Return the share of the deals, the actual one among them, that reach as much."""
    return float((1 + (by_chance_D >= actual - 1e-12).sum()) / (1 + len(by_chance_D)))
