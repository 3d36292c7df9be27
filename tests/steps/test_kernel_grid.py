"""The classifier's kernels, learning rates and iterations, as fitted and as collected."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from gpca.attribution.diagnostics import calibration_error, negative_log_likelihood
from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.errors import InputError
from gpca.evaluation.measures import TIDY_COLUMNS, read_clustered, read_metrics, write_metrics
from gpca.experiments.kernel_grid import collect, collect_intervals, read_grids, setting_name
from gpca.io.csv_file import write_csv
from gpca.pairs.perturbation import CONCEPTS
from gpca.steps.kernel_grid import GRID_COLUMNS, SETTING, KernelGrid, evaluate_grid

GRID = KernelGrid(("rbf", "polynomial"), (0.1, 0.01), (2, 6), inducing=6, draws=40)


@pytest.fixture(scope="module")
def embedded(registrations):
    random = np.random.default_rng(0)
    target_S = [CONCEPTS.index(concept) for concept in registrations.concept]
    embedding = 1.5 * random.normal(size=(3, 10))[target_S] + random.normal(size=(len(registrations), 10))
    return replace(registrations, attached={"embedding": embedding})


@pytest.fixture(scope="module")
def evaluated(embedded):
    return evaluate_grid(embedded, GRID, "tiny", 0)


@pytest.fixture(scope="module")
def grid(evaluated):
    return evaluated[0]


def test_there_is_a_row_for_every_kernel_rate_and_count_judged_by_the_predictions(grid, embedded, evaluated):
    assert list(grid.columns) == list(GRID_COLUMNS)
    assert len(grid) == 2 * 2 * 2
    assert not grid.duplicated(["kernel", "learning_rate", "iterations"]).any()
    assert np.isfinite(grid[list(GRID_COLUMNS[1:])].to_numpy()).all()
    predictions = evaluated[1]
    assert tuple(predictions.columns[:3]) == SETTING and len(predictions) == 8 * len(embedded.rows("test"))
    right = predictions["concept_predicted"] == predictions["concept_true"]
    shares = right.groupby([predictions[name] for name in SETTING], sort=False).mean()
    assert shares.to_numpy().tolist() == grid["accuracy"].tolist()
    assert set(predictions["cluster"]) == set(embedded.cluster[embedded.rows("test")])


@pytest.mark.parametrize("row", range(8))
def test_every_row_is_that_of_a_fit_of_its_own(embedded, grid, row):
    kernel, rate, iterations, *measured = grid.iloc[row]
    gpc = GPC(CONCEPTS, GPCSettings(kernel, rate, int(iterations), inducing=6, draws=40), "tiny", 0)
    train, test = embedded.rows("train"), embedded.rows("test")
    gpc.fit(embedded.embedding[train], embedded.concept[train])
    scores = gpc.attribute(embedded.embedding[test])[0]
    target = np.array([CONCEPTS.index(concept) for concept in embedded.concept[test]])
    assert measured == [
        np.mean(scores.argmax(axis=1) == target),
        gpc.elbo(),
        scores.max(axis=1).mean(),
        calibration_error(scores, target),
        negative_log_likelihood(scores, target),
    ]


def test_intervals_are_of_the_same_measures_over_families(evaluated, grid, tmp_path):
    paths = [tmp_path / "kernel_predictions/tiny" / f"seed{seed}.csv" for seed in (0, 1)]
    for path in paths:
        write_csv(path, evaluated[1])
    write_csv(tmp_path / "intervals.csv", collect_intervals(None, paths), form=None)
    rows = read_clustered(tmp_path / "intervals.csv").set_index(["method", "metric"])
    for row in grid.itertuples():
        name = setting_name(row.kernel, row.learning_rate, row.iterations)
        for measure in ("accuracy", "confidence", "ece", "nll"):
            assert rows.loc[(name, measure), "value"] == pytest.approx(getattr(row, measure), abs=1e-5)
    assert len(rows) == 8 * 4
    assert (rows["seeds"] == 2).all() and (rows["clusters"] == 3).all()
    assert (rows["low"] < rows["high"]).all()


def test_bad_files_are_named(grid, tmp_path):
    path = tmp_path / "kernels/tiny/seed0.csv"
    write_csv(path, grid.assign(nll=np.nan))
    with pytest.raises(InputError, match="column 'nll' contains values that are not finite numbers"):
        read_grids([path])
    write_csv(path, grid.drop(columns="ece"))
    with pytest.raises(InputError, match="column 'ece' is missing"):
        read_grids([path])


def test_every_setting_and_measure_of_every_seed_becomes_a_row(tmp_path):
    files = []
    for seed in (0, 1):
        rows = [
            ("rbf", 0.01, 100, 0.9 + 0.01 * seed, -1.5, 0.5, 0.3, 0.4),
            ("matern32", 0.001, 20, 0.8, -2, 0.4, 0.2, 0.6),
        ]
        files.append(tmp_path / f"kernels/ycb/seed{seed}.csv")
        write_csv(files[-1], pd.DataFrame(rows, columns=list(GRID_COLUMNS)))
    metrics = collect(None, files)
    assert tuple(metrics.columns) == TIDY_COLUMNS
    assert len(metrics) == 2 * 2 * 5
    assert set(metrics["method"]) == {"rbf-0.01-100", "matern32-0.001-20"}
    of_row = metrics[(metrics["method"] == "rbf-0.01-100") & (metrics["metric"] == "accuracy")]
    assert list(of_row.itertuples(index=False, name=None)) == [
        ("kernels", "ycb", "rbf-0.01-100", "accuracy", "all", 0, 0.9),
        ("kernels", "ycb", "rbf-0.01-100", "accuracy", "all", 1, 0.91),
    ]
    write_metrics(metrics, tmp_path / "kernels.csv")
    assert read_metrics(tmp_path / "kernels.csv")["value"].sum() == pytest.approx(metrics["value"].sum())
