"""Grids of kernels and schedules as tidy metrics."""

import pandas as pd
import pytest

from gpca.attribution.metrics import TIDY_COLUMNS as TIDY
from gpca.attribution.metrics import read_metrics, write_metrics
from gpca.classifier.kernel_grid import GRID_COLUMNS, write_grid
from gpca.classifier.kernel_metrics import collect_grids, setting_name
from gpca.errors import InputError


def test_every_setting_and_measure_of_every_seed_becomes_a_row(tmp_path):
    files = []
    for seed in (0, 1):
        rows = [
            ("rbf", 0.01, 100, 0.9 + 0.01 * seed, -1.5, 0.5, 0.3, 0.4),
            ("matern32", 0.001, 20, 0.8, -2, 0.4, 0.2, 0.6),
        ]
        files.append(tmp_path / f"kernels/ycb/seed{seed}.csv")
        write_grid(files[-1], pd.DataFrame(rows, columns=list(GRID_COLUMNS)))
    metrics = collect_grids(files)
    assert tuple(metrics.columns) == TIDY
    assert len(metrics) == 2 * 2 * 5
    assert set(metrics["method"]) == {"rbf-0.01-100", "matern32-0.001-20"}
    of_row = metrics[(metrics["method"] == "rbf-0.01-100") & (metrics["metric"] == "accuracy")]
    assert list(of_row.itertuples(index=False, name=None)) == [
        ("kernels", "ycb", "rbf-0.01-100", "accuracy", "all", 0, 0.9),
        ("kernels", "ycb", "rbf-0.01-100", "accuracy", "all", 1, 0.91),
    ]
    write_metrics(metrics, tmp_path / "kernels.csv")
    assert read_metrics(tmp_path / "kernels.csv")["value"].sum() == pytest.approx(metrics["value"].sum())


def test_a_setting_has_one_name():
    assert setting_name("polynomial", 0.001, 200) == "polynomial-0.001-200"


def test_no_files_are_a_fault():
    with pytest.raises(InputError, match="no files were given"):
        collect_grids([])
