"""How far the untrained rule lies above chance where nothing but the cause has to be named, in words for tables."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from gpca.evaluation.measures import POOLED
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.cells import interval_cell, rows_where

if TYPE_CHECKING:
    import pandas as pd

RULE = "rule"
CHANCE = 100 / len(CONCEPTS)  # of equally many samples of each, in %
NEAR = 10  # points above chance that the rule may have


def rule_near_chance(intervals: pd.DataFrame, sources: Iterable[str], **wanted: object) -> str:
    """Return a further sentence on the rule's share, its distance from chance, and whether its interval ends near that.

    Args:
        intervals: rows with source, method, value, low and high.
        sources: of which the first counts that has the rule, after all together.
        wanted: which other entries the row has.
    """
    of_rule = rows_where(intervals, method=RULE, **wanted)
    for source in (POOLED, *sources):
        rows = rows_where(of_rule, source=source)
        if len(rows) and (bounds := (cell := interval_cell(rows.iloc[0])).bounds):
            low, high = bounds
            ends = "ends within" if high <= CHANCE + NEAR else "reaches beyond"
            return (
                f" There the untrained rule is right in {cell.mean:.1f} % ({low:.1f} to {high:.1f}), which is "
                f"{cell.mean - CHANCE:+.1f} points from chance; the interval {ends} {NEAR} points above chance."
            )
    return ""
