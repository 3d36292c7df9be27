"""How many printed numbers a reading of all tables is close to, beside what chance gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gpca.comparison.chance import WITHIN, is_close, p_value, permuted, weights
from gpca.comparison.published import Number
from gpca.comparison.verdicts import Tolerance

DEVELOPMENT, EVALUATION = "development", "evaluation"  # the samples that scores are of
EVALUATED, JUDGED = "joint_reading", "protocol"  # the joint reading, and the protocol that is judged
Record = tuple[str, str, str, float]  # table or "all", method, metric, value


def counted(
    numbers: Sequence[Number],
    close_K: np.ndarray,
    share: float,
    by_chance: Mapping[str, np.ndarray],
    method: str = EVALUATED,
) -> list[Record]:
    """Return the numbers and the close ones of each table and of all, their share with each table weighted once, and
    the mean share and p of the deals of printed numbers.
    """  # fmt: skip
    records: list[Record] = []
    tables = np.array([number.table for number in numbers])
    for table in dict.fromkeys(tables):
        of_table = close_K[tables == table]
        records += [(table, method, "numbers", len(of_table)), (table, method, "close", of_table.sum())]
    records += [("all", method, "numbers", len(numbers)), ("all", method, "close", close_K.sum())]
    records.append(("all", method, "share", share))
    for within, share_D in by_chance.items():
        records.append(("all", method, f"expected_{within}", share_D.mean()))
        records.append(("all", method, f"p_{within}", p_value(share, share_D)))
    return records


def scored(
    numbers: Sequence[Number],
    value_K: Sequence[tuple[float, bool]],
    tolerances: Mapping[str, Tolerance],
    deals: int,
    method: str,
) -> list[Record]:
    """Return the records of :func:`counted` of values that are fixed, each with whether it is a lower bound."""
    close_K_K = np.array(
        [
            [printed.unit == own.unit and is_close(printed, *value, tolerances[own.unit]) for printed in numbers]
            for own, value in zip(numbers, value_K, strict=True)
        ]
    )
    places_K, weight_K = np.arange(len(numbers)), weights(numbers)
    by_chance = {
        within: np.array([close_K_K[places_K, dealt_K] @ weight_K for dealt_K in permuted(numbers, within, deals)])
        for within in WITHIN
    }
    close_K = close_K_K.diagonal()
    return counted(numbers, close_K, float(close_K @ weight_K), by_chance, method)
