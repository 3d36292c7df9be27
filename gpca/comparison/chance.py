"""How informative the verdicts are about rows: how many shuffled values would agree too, and how the ranks agree.

Within each column of a table, values that stand beside the wrong printed numbers may agree with them as often as beside
the right ones; then the counts of verdicts carry no information about the rows.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gpca.comparison.published import TIMES, UNITS
from gpca.comparison.values import Reproduced
from gpca.comparison.verdicts import CLOSE, JUDGED, REPRODUCED, Printed, Tolerance, judged_once, verdict_of
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

SHUFFLES = 10_000
ALL = "all"
_TIME = "time"


@dataclass(frozen=True)
class Chance:
    """Agreement by chance in one table.

    Attributes:
        agree: how many numbers are reproduced or close.
        expected: how many would be, on average, with the run's values shuffled within the column.
        p: share of the shuffles, the run's own order among them, in which as many are; NaN where none is possible.
        rho: Spearman's rank correlation, the ranks taken within each column; NaN where no column has two values.
    """

    agree: int
    expected: float
    p: float
    rho: float


def chance(comparison: pd.DataFrame, tolerances: Mapping[str, Tolerance]) -> dict[str, Chance]:
    """Return table (and `ALL`) -> :class:`Chance`, of the judged means; repeats of a value are left out.

    Args:
        comparison: as :func:`gpca.comparison.verdicts.compare` returns it, or as read from its file.
        tolerances: one for each unit.
    """
    rows = judged_once(comparison)
    rows = rows[rows["verdict"].isin(JUDGED)]
    kinds = rows["unit"].where(~rows["unit"].isin(TIMES), _TIME)
    shuffled: dict[str, np.ndarray] = {}
    ranked: dict[str, list[np.ndarray]] = {}
    expected: dict[str, float] = {}
    agree: dict[str, int] = {}
    movable: dict[str, bool] = {}
    for (table, column, _), group in rows.groupby(["table", "column", kinds], sort=False):
        fits_K_K = _fits(group, tolerances)
        random = generator("verdicts by chance", table, column)
        order_B_K = random.permuted(np.tile(np.arange(len(group)), (SHUFFLES, 1)), axis=1)
        hits_B = fits_K_K[np.arange(len(group)), order_B_K].sum(axis=1)
        for name in (table, ALL):
            shuffled[name] = shuffled.get(name, 0) + hits_B
            ranked.setdefault(name, []).append(_centered_ranks(group))
            expected[name] = expected.get(name, 0.0) + fits_K_K.sum() / len(group)
            agree[name] = agree.get(name, 0) + int(fits_K_K.trace())
            movable[name] = movable.get(name, False) or len(group) > 1
    return {
        name: Chance(
            agree[name],
            float(expected[name]),
            float((1 + (hits_B >= agree[name]).sum()) / (1 + SHUFFLES)) if movable[name] else math.nan,
            _correlation(np.concatenate(ranked[name])),
        )
        for name, hits_B in shuffled.items()
    }


def _fits(group: pd.DataFrame, tolerances: Mapping[str, Tolerance]) -> np.ndarray:
    """Return (K, K): whether the printed number i agrees with the run's value j."""
    rows = list(group.itertuples())
    values = [_reproduced(row) for row in rows]
    fits_K_K = np.zeros((len(rows), len(rows)), dtype=bool)
    for i, printed in enumerate(rows):
        for j, measured in enumerate(rows):
            in_unit = values[j].times(UNITS[printed.unit].factor / UNITS[measured.unit].factor)
            fits_K_K[i, j] = verdict_of(_printed(printed), in_unit, tolerances[printed.unit]) in (REPRODUCED, CLOSE)
    return fits_K_K


def _printed(row) -> Printed:
    upper = row.published if math.isnan(row.upper) else row.upper
    low, high = (row.published, upper) if math.isnan(row.paper_low) else (row.paper_low, row.paper_high)
    return Printed(row.published, upper, 0.5 * 10.0**-row.decimals, low, high)


def _reproduced(row) -> Reproduced:
    return Reproduced(
        row.reproduced, row.ci_low, row.ci_high, int(row.n), bool(row.at_least), row.cluster_low, row.cluster_high
    )


def _centered_ranks(group: pd.DataFrame) -> np.ndarray:
    """Return (K, 2): ranks of the printed numbers and of the run's, less their mean; times in seconds."""
    factor = group["unit"].map(lambda unit: UNITS[unit].factor)
    ranks_K_2 = np.stack([(group[name] / factor).rank() for name in ("published", "reproduced")], axis=1)
    return ranks_K_2 - ranks_K_2.mean(axis=0)


def _correlation(ranks_N_2: np.ndarray) -> float:
    one_N, other_N = ranks_N_2.T
    norm = math.sqrt((one_N @ one_N) * (other_N @ other_N))
    return float(one_N @ other_N / norm) if norm else math.nan
