"""How many shuffled numbers would agree too: chance of the verdicts, and of the share of close numbers."""

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from gpca.comparison import verdicts
from gpca.comparison.published import TIMES, UNITS, Number
from gpca.comparison.values import Reproduced
from gpca.comparison.verdicts import Printed, Tolerance
from gpca.io.frame import Frame
from gpca.seeds import generator

SHUFFLES = 10_000
ALL = "all"
WITHIN: Mapping[str, Callable[[Number], tuple[str, ...]]] = {  # printed numbers of one group may change places
    "unit": lambda number: (number.table, number.unit),
    "column": lambda number: (number.table, number.column, number.unit),
}


class Agreement(NamedTuple):
    """Agreement with the numbers of one table, and by chance."""

    agree: int  # numbers that are reproduced or close
    expected: float  # mean of that count with the run's values shuffled within the column
    p: float  # share of shuffles, the run's order included, with as many; NaN where none is possible
    rho: float  # Spearman's rank correlation, with ranks within each column; NaN where no column has two values


def chance(comparison: Frame, tolerances: Mapping[str, Tolerance]) -> dict[str, Agreement]:
    """Return table (and `ALL`) -> agreement of the judged means of a comparison, each value once."""
    rows = verdicts.judged_once(comparison)
    rows = rows[rows["verdict"].isin(verdicts.JUDGED)]
    kinds = rows["unit"].where(~rows["unit"].isin(TIMES), "time")
    columns: dict[str, list[tuple]] = {}  # per table: counts of agreement and centered ranks of each column
    for (table, column, _), group in rows.groupby(["table", "column", kinds], sort=False):
        printed = list(group.itertuples())
        fits_K_K = np.zeros((len(group), len(group)), dtype=bool)  # the printed number i agrees with the run's value j
        for (i, row), (j, run) in product(enumerate(printed), repeat=2):
            upper = row.published if math.isnan(row.upper) else row.upper
            low, high = (row.published, upper) if math.isnan(row.paper_low) else (row.paper_low, row.paper_high)
            stated = Printed(row.published, upper, 0.5 * 10.0**-row.decimals, low, high)
            to_unit = UNITS[row.unit].factor / UNITS[run.unit].factor
            mean, low, high = (to_unit * value for value in (run.reproduced, run.ci_low, run.ci_high))
            value = Reproduced(mean, low, high, int(run.n), bool(run.at_least))
            verdict = verdicts.verdict_of(stated, value, tolerances[row.unit])
            fits_K_K[i, j] = verdict in (verdicts.REPRODUCED, verdicts.CLOSE)
        random = generator("verdicts by chance", table, column)
        order_B_K = random.permuted(np.tile(np.arange(len(group)), (SHUFFLES, 1)), axis=1)
        hits_B = fits_K_K[np.arange(len(group)), order_B_K].sum(axis=1)
        factor = group["unit"].map(lambda unit: UNITS[unit].factor)  # times in seconds
        ranks_K_2 = np.stack([(group[name] / factor).rank() for name in ("published", "reproduced")], axis=1)
        measured = (int(fits_K_K.trace()), fits_K_K.sum() / len(group), hits_B, ranks_K_2 - ranks_K_2.mean(axis=0))
        for name in (table, ALL):
            columns.setdefault(name, []).append(measured)
    chances = {}
    for name, parts in columns.items():
        agree, expected, hits_B = (sum(part[i] for part in parts) for i in range(3))
        ranks_N_2 = np.concatenate([part[3] for part in parts])
        movable = len(ranks_N_2) > len(parts)
        p = float((1 + (hits_B >= agree).sum()) / (1 + SHUFFLES)) if movable else math.nan
        one_N, other_N = ranks_N_2.T
        norm = math.sqrt((one_N @ one_N) * (other_N @ other_N))
        chances[name] = Agreement(agree, float(expected), p, float(one_N @ other_N / norm) if norm else math.nan)
    return chances


def is_close(number: Number, value: float, at_least: bool, tolerance: Tolerance) -> bool:
    """Return whether a value, in the number's unit, lies within the close tolerance; a lower bound never does."""
    return not at_least and abs(verdicts.distance(number, value, tolerance)) <= 1


def weights(numbers: Sequence[Number]) -> np.ndarray:
    """Return the weights (K,) of numbers, which sum to 1: equal for all tables, and for all numbers of a table."""
    tables = [number.table for number in numbers]
    return np.array([1 / (len(set(tables)) * tables.count(table)) for table in tables])


def permuted(numbers: Sequence[Number], within: str, repeats: int) -> np.ndarray:
    """Return (repeats, K): the number whose printed value takes the place of each, permuted within groups."""
    groups: dict[tuple[str, ...], list[int]] = {}
    for index, number in enumerate(numbers):
        groups.setdefault(WITHIN[within](number), []).append(index)
    permuted_D_K = np.tile(np.arange(len(numbers)), (repeats, 1))
    for group, indices in groups.items():
        random = generator("printed numbers dealt anew", within, *group)
        permuted_D_K[:, indices] = random.permuted(np.tile(indices, (repeats, 1)), axis=1)
    return permuted_D_K


def p_value(actual: float, by_chance_D: np.ndarray) -> float:
    """Return the share of the permutations, the actual order included, that reach as much."""
    return float((1 + (by_chance_D >= actual - 1e-12).sum()) / (1 + len(by_chance_D)))
