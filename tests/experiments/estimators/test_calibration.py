"""Metrics of estimators, on rows whose numbers are known."""

import numpy as np
import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.experiments.estimators.calibration import collect_estimate_seconds, collect_estimates, measure
from gpca.experiments.estimators.covariances import (
    JUDGED,
    ReferenceSamples,
    covariance_columns,
    covariance_of,
    read_estimates,
)
from gpca.io.csv_file import write_csv

SIGMA = 1e-4 * np.eye(6) + 1e-5


def rows(n=20, method="point_to_point", **changes):
    of_all = {
        "sample": np.arange(n), "object": "cup", "method": method, "add_relative": np.linspace(0.01, 0.1, n),
        "failed": np.arange(n) >= n // 2, "failure": "", "kl_rotation": 2.0, "kl_translation": 3.0,
        "error_ratio": 4.0, "mahalanobis": 12.0, "spread": np.linspace(0.02, 0.2, n),
    }  # fmt: skip
    return pd.DataFrame(of_all | changes | covariance_columns(SIGMA))


def without(frame, chosen):
    """The estimates of these rows have failed."""
    frame = frame.copy()
    frame.loc[chosen, "failure"] = "singular"
    frame.loc[chosen, [*JUDGED, *covariance_columns(None)]] = np.nan
    return frame


@pytest.fixture
def file(tmp_path):
    def written(frame, name="ycb/brossard/seed3.csv"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_csv(path, frame)
        return path

    return written


def test_every_metric_by_hand(file):
    metrics = measure(read_estimates(file(rows())))
    assert metrics == {
        "no_estimate": 0, "test_samples": 20, "kl_rotation": 2, "kl_translation": 3, "nne": 2, "nees": 2,
        "coverage": 1, "auroc_failed": 1, "spearman_error": pytest.approx(1),
    }  # fmt: skip


def test_means_leave_out_a_tenth_at_either_end():
    wild = np.where(np.arange(20) < 2, 1e9, 3.0)
    metrics = measure(rows(kl_rotation=wild, mahalanobis=wild, error_ratio=wild))
    assert (metrics["kl_rotation"], metrics["nees"]) == (3, 0.5)
    assert metrics["nne"] == pytest.approx(3**0.5)
    assert metrics["coverage"] == 0.9  # and this does not


def test_the_coverage_is_by_the_quantile_of_six_degrees():
    assert measure(rows(mahalanobis=np.where(np.arange(20) < 5, 12.591, 12.592)))["coverage"] == 0.25


def test_of_gaussian_errors_a_right_covariance_scores_right():
    random = np.random.default_rng(0)
    errors = random.multivariate_normal(np.zeros(6), SIGMA, size=4000)
    squares = np.einsum("ni,ij,nj->n", errors, np.linalg.inv(SIGMA), errors)
    metrics = measure(rows(4000, mahalanobis=squares, error_ratio=np.square(errors).sum(axis=1) / np.trace(SIGMA)))
    assert metrics["coverage"] == pytest.approx(0.95, abs=0.01)
    # The distribution is skewed, so that its middle lies below its mean.
    assert metrics["nees"] == pytest.approx(0.93, abs=0.02)
    assert metrics["nne"] == pytest.approx(0.96, abs=0.04)


def test_what_failed_is_counted_and_left_out_of_the_rest(file):
    some = without(rows(spread=np.linspace(0.2, 0.02, 20)), slice(0, 3))
    metrics = measure(read_estimates(file(some)))
    assert metrics["no_estimate"] == pytest.approx(0.2)
    assert metrics["test_samples"] == 20
    assert metrics["auroc_failed"] == 0
    assert metrics["spearman_error"] == pytest.approx(-1)
    assert measure(read_estimates(file(without(rows(), slice(None))))) == {"no_estimate": 1, "test_samples": 20}


def test_what_is_not_defined_has_no_row(file):
    tidy = collect_estimates([file(rows(failed=False))])
    assert "auroc_failed" not in set(tidy["metric"])
    assert set(tidy["source"]) | set(tidy["method"]) | set(tidy["concept"]) == {"ycb", "brossard", "point_to_point"}
    assert set(tidy["seed"]) == {3}
    without_reference = rows(kl_rotation=np.nan, kl_translation=np.nan)
    assert "kl_rotation" not in set(collect_estimates([file(without_reference)])["metric"])


def test_registration_methods_stand_apart(file):
    both = pd.concat([rows(), rows(10, "point_to_plane", kl_rotation=7.0)])
    tidy = collect_estimates([file(both)]).set_index(["metric", "concept"])["value"]
    assert tidy["kl_rotation", "point_to_point"] == 2
    assert tidy["kl_rotation", "point_to_plane"] == 7
    assert tidy["test_samples", "point_to_plane"] == 10


def test_seconds_are_medians(file):
    seconds = pd.DataFrame({"sample": [0, 1, 2], "method": "point_to_point", "seconds": [0.1, 0.2, 9.0]})
    tidy = collect_estimate_seconds([file(seconds, "ycb/estimator_brossard/seed3.csv")])
    assert tidy[["method", "concept", "value"]].to_numpy().tolist() == [["brossard", "point_to_point", 0.2]]


def test_a_covariance_survives_the_file(file):
    found = read_estimates(file(rows()))
    assert covariance_of(found.iloc[0]) == pytest.approx(SIGMA, abs=1e-12)
    assert found["failed"].tolist() == [False] * 10 + [True] * 10


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mahalanobis": "many"}, "column 'mahalanobis' contains values that are not finite numbers"),
        ({"add_relative": ""}, "column 'add_relative'"),
    ],
)
def test_a_faulty_file_is_one_line(file, changes, message):
    with pytest.raises(InputError, match=message):
        read_estimates(file(rows(**changes)))


SAMPLES = ReferenceSamples(
    np.array([4, 5]), np.array(["gicp", "gicp"]), np.ones((5, 6), np.float32), np.array([0, 3, 5]), np.zeros((2, 6))
)


def test_samples_survive_the_file(tmp_path):
    SAMPLES.save(tmp_path / "a.npz", ("cups", 0))
    loaded = ReferenceSamples.load(tmp_path / "a.npz")
    assert loaded.twists_of(1).shape == (2, 6)
    assert loaded.sample.tolist() == [4, 5]
