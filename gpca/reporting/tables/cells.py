"""Makes the cells of tables: means over seeds, shares of samples, and values that have their interval already."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from math import isfinite, isnan, nan
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.confidence import wilson_interval
from gpca.attribution.metrics import mean_interval
from gpca.reporting.tables.table import LEAST_SEEDS, SHARE, Cell, Column

if TYPE_CHECKING:
    import pandas as pd

WILSON = "In brackets: the Wilson interval (95 %)"


def rows_where(frame: pd.DataFrame, **wanted: object) -> pd.DataFrame:
    """Return the rows whose columns hold these values, e.g. ``rows_where(metrics, source="ycb", concept="all")``."""
    chosen = None
    for column, value in wanted.items():
        holds = frame[column] == value
        chosen = holds if chosen is None else chosen & holds
    return frame if chosen is None else frame[chosen]


def cell_of_repeats(
    values_R: Collection[float], test_samples: int, at_least: bool = False, clusters: int = 0
) -> Cell | None:
    """Return the mean over R repeats with the half-width of its t-interval, or None without any repeat.

    Fewer than `LEAST_SEEDS` repeats have no interval.

    Args:
        values_R: One value per seed, in the column's unit.
        test_samples: The number of test samples of all seeds together.
        at_least: Whether some repeat was stopped before it was done, which makes the mean a lower bound.
        clusters: In how many clusters the samples are, those of each seed counted; 0 where that is not known.
    """
    if len(values_R) == 0:
        return None
    mean, low, _ = mean_interval(values_R)
    half_width = mean - low if len(values_R) >= LEAST_SEEDS else nan
    return Cell(mean, half_width, len(values_R), test_samples, at_least, clusters=clusters)


def share_within_limits(cell: Cell, column: Column) -> Cell:
    """Return the cell of a share in % with bounds, where its t-interval has no width or reaches beyond 0 or 100 %.

    They are the farther ones of that interval, cut at the limits, and of Wilson's. For this a cluster counts once in
    each seed, or where the clusters are not known, a sample in one seed alone; without either there is no interval.
    """
    is_share = column.of_samples and column.limits == SHARE and not column.beside
    if not is_share or cell.bounds or cell.at_least or isnan(cell.half_width):
        return cell
    (least, most), low, high = column.limits, cell.mean - cell.half_width, cell.mean + cell.half_width
    if cell.half_width >= 0.5 * 10.0**-column.decimals and least <= low and high <= most:
        return cell
    if not (trials := cell.clusters or cell.test_samples // cell.seeds) or not least <= cell.mean <= most:
        return replace(cell, half_width=nan)
    of_wilson = wilson_interval(cell.mean / most * trials, trials)
    return replace(cell, bounds=(max(least, min(low, most * of_wilson[0])), min(most, max(high, most * of_wilson[1]))))


def cell_of_all_samples(values_R: Sequence[float], samples_R: Sequence[float]) -> Cell | None:
    """Return the mean over the samples of R seeds, which have unequally many, or None without any seed.

    The interval is that of a ratio of two means over the seeds (by its linearization), which for equally many samples
    is the t-interval of the seeds' means.

    Args:
        values_R: The mean over the samples of each seed, in the column's unit.
        samples_R: How many these are.
    """
    value_R, sample_R = np.asarray(values_R, float), np.asarray(samples_R, float)
    if not len(value_R):
        return None
    mean = np.average(value_R, weights=sample_R)
    return cell_of_repeats(mean + sample_R / sample_R.mean() * (value_R - mean), int(sample_R.sum()))


def cell_over_sources(
    metrics: pd.DataFrame,
    values: pd.DataFrame,
    sources: Iterable[str],
    method: str,
    metric: str,
    concept: str,
    factor: float,
) -> Cell | None:
    """Return the mean over the seeds of what all pairs of a seed have, whatever their source."""
    counts = rows_where(metrics, method=method, metric="test_samples", concept=concept)
    of_metric = rows_where(values, method=method, metric=metric, concept=concept)
    both = of_metric.merge(counts, on=["source", "seed"], suffixes=("", "_n"))
    both = both[both["source"].isin(list(sources))]
    sums = (both["value"] * both["value_n"]).groupby(both["seed"]).sum()
    counts_R = both.groupby("seed")["value_n"].sum()
    return cell_of_repeats((factor * sums / counts_R).to_numpy(), int(counts_R.sum()))


def interval_cell(row: pd.Series, value: str = "value", bounds: Sequence[str] = ("low", "high"), factor: float = 100):
    """Return the cell of a row that has its interval in two columns of it, and ``seeds`` and ``samples``."""
    low, high = (factor * row[name] for name in bounds)
    known = (low, high) if isfinite(low) and isfinite(high) else None
    return Cell(factor * row[value], (high - low) / 2, int(row["seeds"]), int(row["samples"]), bounds=known)


def plain_cell(value: float, seeds: int, test_samples: int) -> Cell:
    """Return a number that has no interval."""
    return Cell(value, nan, seeds, test_samples)


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
