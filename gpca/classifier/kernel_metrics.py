"""From the grids of kernels and schedules to numbers: of every source, setting and seed, as one tidy table."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.attribution.metrics import ALL, tidy
from gpca.classifier.kernel_grid import MEASURES, read_grids

if TYPE_CHECKING:
    import pandas as pd

TABLE = "kernels"  # `table` of the tidy rows reads this


def collect_grids(files: Iterable[str | Path]) -> pd.DataFrame:
    """Return the tidy metrics (`MEASURES`) of files named `…/{source}/seed{seed}.csv`.

    Their `method` is as :func:`setting_name` has it.

    Raises:
        InputError: where :func:`read_grids` raises one.
    """
    records = [
        (TABLE, row.source, setting_name(row.kernel, row.learning_rate, row.iterations), measure, ALL, row.seed, value)
        for row in read_grids(files).itertuples()
        for measure in MEASURES
        for value in [float(getattr(row, measure))]
    ]
    return tidy(records, "kernels")


def setting_name(kernel: str, learning_rate: float, iterations: int) -> str:
    """Return e.g. ``rbf-0.01-100``."""
    return f"{kernel}-{learning_rate:g}-{iterations}"
