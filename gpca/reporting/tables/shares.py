"""Makes cells of shares of counted samples: their intervals are Wilson's, which stay within 0 and 100 %."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.confidence import wilson_interval
from gpca.reporting.tables.builder import rows_where
from gpca.reporting.tables.table import Cell

if TYPE_CHECKING:
    import pandas as pd

WILSON = "In brackets: the Wilson interval (95 %)"


def share_cell(share: float, trials: int, seeds: int) -> Cell:
    """Return a share of pooled trials as a cell in %, with its Wilson interval."""
    low, high = (100 * bound for bound in wilson_interval(share * trials, trials))
    return Cell(100 * share, (high - low) / 2, seeds, trials, bounds=(low, high))


def share_over_sources(
    metrics: pd.DataFrame, sources: Iterable[str], method: str, metric: str, concept: str
) -> Cell | None:
    """Return a share of the test samples of all sources and seeds together, or None where there is none.

    Args:
        metrics: Tidy metrics, with ``test_samples``.
        sources, method, metric, concept: Which share.
    """
    counts = rows_where(metrics, method=method, metric="test_samples", concept=concept)
    shares = rows_where(metrics, method=method, metric=metric, concept=concept)
    both = shares.merge(counts, on=["source", "seed"], suffixes=("", "_n"))
    both = both[both["source"].isin(list(sources))]
    if both.empty:
        return None
    share = float(np.average(both["value"], weights=both["value_n"]))
    return share_cell(share, int(both["value_n"].sum()), both["seed"].nunique())
