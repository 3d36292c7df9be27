"""Shares of counted samples with Wilson's interval."""

import pytest

from gpca.attribution.confidence import wilson_interval
from gpca.attribution.metrics import tidy
from gpca.reporting.tables.cells import share_cell, share_over_sources
from gpca.reporting.tables.table import Column


def test_a_share_has_an_interval_within_its_limits():
    assert Column("A").text(share_cell(0.0, 18, 3)) == "0.0 (0.0 to 17.6)"
    assert Column("A").text(share_cell(1.0, 18, 3)) == "100.0 (82.4 to 100.0)"
    cell = share_cell(8 / 18, 18, 3)
    assert cell.bounds == tuple(100 * bound for bound in wilson_interval(8, 18))
    assert (cell.mean, cell.seeds, cell.test_samples) == (pytest.approx(44.444, abs=1e-3), 3, 18)


def test_a_share_is_over_the_samples_of_all_sources_and_seeds():
    rows = []
    for source, seed, samples, value in (("ycb", 0, 30, 0.5), ("ycb", 1, 10, 0.9), ("cups", 0, 60, 0.0)):
        of = {"accuracy": value, "test_samples": samples}
        rows += [("t", source, "m", metric, "all", seed, number) for metric, number in of.items()]
    metrics = tidy(rows, "metrics")
    cell = share_over_sources(metrics, ["ycb", "cups"], "m", "accuracy", "all")
    assert (cell.mean, cell.seeds, cell.test_samples) == (pytest.approx(24), 2, 100)
    assert share_over_sources(metrics, ["ycb"], "m", "accuracy", "all").mean == pytest.approx(60)
    assert share_over_sources(metrics, ["ycb"], "other", "accuracy", "all") is None
