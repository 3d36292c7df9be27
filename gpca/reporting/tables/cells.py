"""Makes the cells of tables: means over seeds, shares of samples, and values that have their interval already."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from math import isfinite, isnan, nan

from gpca.evaluation.intervals import mean_interval, wilson_interval
from gpca.io.frame import Frame, Series
from gpca.reporting.tables.table import LEAST_SEEDS, SHARE, Cell, Column


def where(frame: Frame, entries: Mapping[str, object]) -> Frame:
    """Return the rows of a frame with these entries; a column that it lacks is empty."""
    for column, value in entries.items():
        if column in frame:
            frame = frame[frame[column] == value]
        elif value:
            return frame[:0]
    return frame


def rows_where(frame: Frame, **wanted: object) -> Frame:
    return where(frame, wanted)


def cell_of_repeats(
    values_R: Collection[float], test_samples: int, at_least: bool = False, clusters: int = 0
) -> Cell | None:
    """Return the mean over R seeds with the half-width of its t-interval; None for no seed, no interval for few.

    Numbers of test samples and of clusters (0 where unknown) are those of all seeds together. With `at_least`, some
    repeat was stopped before it was done, which makes the mean a lower bound.
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
    is_share = column.limits == SHARE and not column.beside
    if not is_share or cell.bounds or cell.at_least or isnan(cell.half_width):
        return cell
    (least, most), low, high = SHARE, cell.mean - cell.half_width, cell.mean + cell.half_width
    if cell.half_width >= 0.5 * 10.0**-column.decimals and least <= low and high <= most:
        return cell
    if not (trials := cell.clusters or cell.test_samples // cell.seeds) or not least <= cell.mean <= most:
        return replace(cell, half_width=nan)
    return replace(cell, bounds=_farther_bounds(cell, trials))


def cautious_cell(values_R: Collection[float], test_samples: int, clusters: int) -> Cell | None:
    """Return the mean of a share in % over R seeds of which no single answers are kept, or None without any seed.

    Its bounds are those of :func:`_farther_bounds`, in which a cluster counts once in each seed.
    """
    cell = cell_of_repeats(values_R, test_samples, clusters=clusters)
    if cell is None or not clusters:
        return cell
    low, high = _farther_bounds(cell, clusters)
    return replace(cell, bounds=(low, high), half_width=(high - low) / 2)


def _farther_bounds(cell: Cell, trials: int) -> tuple[float, float]:
    """Return the farther bounds of the t-interval of a share in %, if it has one, and of Wilson's interval."""
    (least, most), half_width = SHARE, 0.0 if isnan(cell.half_width) else cell.half_width
    low, high = (most * bound for bound in wilson_interval(cell.mean / most * trials, trials))
    return max(least, min(cell.mean - half_width, low)), min(most, max(cell.mean + half_width, high))


def interval_cell(row: Series, value: str = "value", bounds: Sequence[str] = ("low", "high"), factor: float = 100):
    """Return the cell of a row that has its interval in two columns of it, and ``seeds`` and ``samples``."""
    low, high = (factor * row[name] for name in bounds)
    finite = (low, high) if isfinite(low) and isfinite(high) else None
    return Cell(factor * row[value], (high - low) / 2, int(row["seeds"]), int(row["samples"]), bounds=finite)


def plain_cell(value: float, seeds: int, test_samples: int) -> Cell:
    return Cell(value, nan, seeds, test_samples)
