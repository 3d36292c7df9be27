"""Cells with intervals over clusters, and of shares of which no single answers are kept."""

import math

import pandas as pd
import pytest

from gpca.evaluation.intervals import mean_interval, wilson_interval
from gpca.evaluation.measures import COLUMNS
from gpca.reporting.tables.cells import cautious_cell, cell_of_repeats, interval_cell, share_within_limits
from gpca.reporting.tables.table import Column

INTERVALS = pd.DataFrame(
    [
        ("t", "ycb", "gpca", "accuracy", "all", 3, 11, 180, 0.95, 0.9, 0.98),
        ("t", "ycb", "gpca", "ece", "all", 3, 11, 180, 0.05, math.nan, math.nan),
    ],
    columns=[*COLUMNS],
)


def test_a_cell_has_the_interval_of_its_row_or_the_farther_bounds_of_two():
    cell = interval_cell(INTERVALS.iloc[0])
    assert (cell.mean, cell.seeds, cell.test_samples) == (95, 3, 180)
    assert Column("A").text(cell) == "95.0 (90.0 to 98.0)"
    without = interval_cell(INTERVALS.iloc[1], factor=1)
    assert Column("ECE", decimals=3).text(without) == "0.050"
    low, high = (100 * bound for bound in wilson_interval(0.9 * 33, 33))
    agreed = cautious_cell([90, 90, 90], 180, 33)
    assert agreed.bounds == pytest.approx((low, high)) and Column("A").text(agreed) == f"90.0 ({low:.1f} to {high:.1f})"
    spread = cautious_cell([80, 90, 100], 180, 33)
    assert spread.bounds == (mean_interval([80, 90, 100])[1], 100)  # cut at the limit
    assert cautious_cell([90, 90], 120, 33).bounds == pytest.approx((low, high))  # two seeds have no t-interval
    assert cautious_cell([90, 90, 90], 180, 0).bounds is None
    assert cautious_cell([], 0, 33) is None


def test_a_share_near_its_limits_never_has_an_interval_of_no_width():
    agreed = share_within_limits(cell_of_repeats([100, 100, 100], 600, clusters=12), Column("A"))
    assert agreed.bounds == (pytest.approx(100 * wilson_interval(12, 12)[0]), 100)
    cut = share_within_limits(cell_of_repeats([100, 100, 97], 600), Column("A"))  # that of the seeds is wider
    assert Column("A").text(cut) == "99.0 (94.7 to 100.0)"
    inside = cell_of_repeats([60, 70, 65], 600, clusters=12)
    assert share_within_limits(inside, Column("A")) == inside
