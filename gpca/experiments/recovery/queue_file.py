"""The error by labels of queued cases, over all seeds."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.attribution.confidence import wilson_interval
from gpca.io.csv_file import read_numbers

if TYPE_CHECKING:
    import pandas as pd

DOUBTED, DRAWN = "queued", "random"  # which cases are labeled next: those in doubt, or any
QUEUE_COLUMNS = ("policy", "order", "draw", "labels", "failures", "unsolved")


def read_queues(files: Iterable[str | Path]) -> pd.DataFrame:
    """Return ``policy, order, labels, failures, error, low, high``: shares of the failures of all seeds.

    Only numbers of labels that every seed has are kept. Of random orders it is the mean; the bounds are Wilson's, as if
    each failure were judged once.

    Raises:
        InputError: a missing column, or no rows.
    """
    import pandas as pd

    parts = []
    for path in files:
        rows = read_numbers(path, QUEUE_COLUMNS, QUEUE_COLUMNS[2:])
        mean = rows.groupby(["policy", "order", "labels"], sort=False)[["failures", "unsolved"]].mean()
        parts.append(mean.reset_index())
    grouped = pd.concat(parts).groupby(["policy", "order", "labels"], sort=False)
    together = grouped[["failures", "unsolved"]].sum()[grouped.size() == len(parts)].reset_index()
    shares = [wilson_interval(row.unsolved, int(row.failures)) for row in together.itertuples()]
    together[["low", "high"]] = pd.DataFrame(shares, index=together.index)
    return together.assign(error=together["unsolved"] / together["failures"]).drop(columns="unsolved")
