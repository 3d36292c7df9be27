"""Rows of registration methods as tidy metrics."""

import numpy as np
import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.evaluation.measures import TIDY_COLUMNS as TIDY
from gpca.experiments.registration_methods import (
    MEASURED,
    collect_seconds,
    collect_trials,
    read_trials,
    row_name,
    share_of_milder,
)
from gpca.io.csv_file import write_csv
from gpca.pairs.perturbation import CONCEPTS
from gpca.steps.registration_trials import SEVERITY_COLUMNS

SUCCESS = {"error": 0.03, "curve": [0.005, 0.03, 0.5]}
RANGES = {"noise": [0.01, 0.03], "rotation_deg": [15, 60], "translation": [0.05, 0.30], "crop": [0.2, 0.6]}


def trials(starts=("initial", "fgr"), **changes):
    """Six pairs, two of each cause, the milder one a success from the first start."""
    severe, mild = (
        dict(zip(SEVERITY_COLUMNS, of, strict=True)) for of in ((0.029, 1.0, 0.29, 0.58), (0.011, 0.3, 0.06, 0.22))
    )
    records = []
    for sample in range(6):
        for start in starts:
            good = sample < 3 and start == starts[0]
            errors = dict(zip(MEASURED, (0.01, 0.1, 0.02) if good else (0.3, 1.1, 0.2), strict=True))
            known = {"sample": sample, "concept": CONCEPTS[sample % 3], "start": start}
            told = known | (mild if sample < 3 else severe) | errors | {"points": 300 + 100 * (sample % 2)}
            records.append(told | {"failure": "" if good else "lost, alas"})
    return pd.DataFrame(records).assign(**changes)


@pytest.fixture
def written(tmp_path):
    def write(rows, method="gicp", seed=0, source="ycb"):
        path = tmp_path / f"methods/{source}/{method}/seed{seed}.csv"
        write_csv(path, rows)
        return path

    return write


def value(metrics, **wanted):
    found = metrics
    for column, content in wanted.items():
        found = found[found[column] == content]
    [number] = found["value"]
    return number


def test_every_start_cause_and_bin_has_its_metrics(written):
    metrics = collect_trials([written(trials(), seed=seed) for seed in (0, 1)], RANGES, SUCCESS)
    assert tuple(metrics.columns) == TIDY
    assert set(metrics["method"]) == {"gicp", "fgr+gicp"}
    first = metrics[metrics["seed"] == 1]
    told = {"method": "gicp", "concept": "all"}
    assert value(first, metric="success", **told) == pytest.approx(0.5)
    assert value(first, metric="failed", **told) == pytest.approx(0.5)
    # What gave up is no success, however large an error is allowed.
    assert [value(first, metric=f"success_{limit}", **told) for limit in ("0.5", "3", "50")] == [0, 0.5, 0.5]
    assert value(first, metric="add", **told) == pytest.approx(0.155)
    assert value(first, metric="rotation_deg", **told) == pytest.approx(np.rad2deg(0.6))
    assert value(first, metric="translation", **told) == pytest.approx(0.11)
    assert value(first, metric="test_samples", **told) == 6
    assert value(first, metric="points", **told) == 350
    for concept in CONCEPTS:
        assert value(first, method="gicp", metric="test_samples", concept=concept) == 2
        assert value(first, method="gicp", metric="success", concept=f"{concept}_low") == 1
        assert value(first, method="gicp", metric="success", concept=f"{concept}_high") == 0
        assert value(first, method="fgr+gicp", metric="success", concept=concept) == 0
    assert not metrics["concept"].str.endswith("middle").any()  # of which there is none


def test_a_global_method_has_one_row_of_its_name(written):
    metrics = collect_trials([written(trials(("none",)), "fgr")], RANGES, SUCCESS)
    assert set(metrics["method"]) == {"fgr"}
    assert [row_name("gicp", start) for start in ("initial", "none", "teaser")] == ["gicp", "gicp", "teaser+gicp"]


def test_thirds_of_what_is_drawn_have_a_third_of_the_draws_each():
    random, draws = np.random.default_rng(0), 30_000
    rows = pd.DataFrame(
        {
            "severity_noise": random.uniform(0.01, 0.03, draws),
            "severity_rotation_rad": np.deg2rad(random.uniform(15, 60, draws)),
            "severity_translation": random.uniform(0.05, 0.30, draws),
            "severity_crop": random.uniform(0.2, 0.6, draws),
        }
    )
    for concept in CONCEPTS:
        shares = share_of_milder(rows, concept, RANGES)
        np.testing.assert_allclose(np.histogram(shares, 3, (0, 1))[0] / draws, 1 / 3, atol=0.01)
    worst = pd.DataFrame({"severity_rotation_rad": [np.pi / 3, np.pi / 12], "severity_translation": [0.30, 0.05]})
    assert share_of_milder(worst, "pose", RANGES) == pytest.approx([1, 0])
    assert np.isfinite(share_of_milder(rows, "overlap", RANGES | {"crop": [0.3, 0.3]})).all()


def test_seconds_are_means_of_each_start(tmp_path):
    path = tmp_path / "timings/ycb/method_gicp/seed3.csv"
    write_csv(path, pd.DataFrame({"sample": [0, 0, 1, 1], "start": ["initial", "fgr"] * 2, "seconds": [1, 3, 2, 5]}))
    seconds = collect_seconds([path])
    assert value(seconds, method="gicp", metric="seconds") == 1.5
    assert value(seconds, method="fgr+gicp", metric="seconds", seed=3, source="ycb", concept="all") == 4


def test_the_file_is_read_as_it_was_written(written):
    rows = read_trials(written(trials()))
    assert rows["add_relative"].tolist() == trials()["add_relative"].tolist()
    assert set(rows["failure"]) == {"", "lost, alas"}
    assert rows[list(SEVERITY_COLUMNS)].to_numpy() == pytest.approx(
        trials()[list(SEVERITY_COLUMNS)].to_numpy(), abs=1e-6
    )


def test_what_is_no_number_is_named(written):
    with pytest.raises(InputError, match="column 'add_relative' contains values that are not finite numbers"):
        collect_trials([written(trials(add_relative=np.nan))], RANGES, SUCCESS)


def test_no_files_are_a_fault(tmp_path):
    with pytest.raises(InputError, match="no files were given"):
        collect_trials([], RANGES, SUCCESS)
    with pytest.raises(InputError, match="no files were given"):
        collect_seconds([])
