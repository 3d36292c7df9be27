"""Metrics of estimators, on rows whose numbers are known."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import trim_mean

from gpca.errors import InputError
from gpca.experiments import estimators
from gpca.experiments.estimators import TRUTH, collect_estimate_seconds, measure, read_intervals, trimmed_mean
from gpca.io.csv_file import write_csv
from gpca.uncertainty.estimates import JUDGED, KINDS, REFERENCES, covariance_columns, read_estimates

from ..steps.test_estimates import covariance_of
from .runs import run_with

RUN = run_with()
SIGMA = 1e-4 * np.eye(6) + 1e-5


def rows(n=20, method="point_to_point", **changes):
    of_all = {
        "sample": np.arange(n), "object": "cup",
        "cluster": np.array(["cups", "cans", "boxes", "cars"])[np.arange(n) % 4],
        "method": method, "add_relative": np.linspace(0.01, 0.1, n), "failed": np.arange(n) >= n // 2,
        "inlier_rmse": np.linspace(0.01, 0.02, n), "fitness": 0.9, "failure": "",
        "error_ratio": 4.0, "mahalanobis": 12.0, "spread": np.linspace(0.02, 0.2, n),
    }  # fmt: skip
    for k, kind in enumerate(KINDS):
        of_all |= {f"kl_rotation_{kind}": 2.0 + k, f"kl_translation_{kind}": 3.0 + k, f"error_ratio_{kind}": 9.0}
        of_all |= {f"mahalanobis_{kind}": 6.0 * (1 + k), f"covered_{kind}": 0.9 - 0.1 * k}
    return pd.DataFrame(of_all | changes | covariance_columns(SIGMA))


def without(frame, chosen):
    """The estimates of these rows have failed."""
    frame = frame.copy()
    frame.loc[chosen, "failure"] = "singular"
    frame.loc[chosen, [*JUDGED, *covariance_columns(None)]] = np.nan
    return frame


def ones(n=20):
    return np.ones((1, n))


@pytest.fixture
def file(tmp_path):
    def written(frame, name="ycb/brossard/seed3.csv"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_csv(path, frame)
        return path

    return written


def test_every_metric_by_hand_and_the_covariance_survives_the_file(file):
    metrics = {name: value[0] for name, value in measure(read_estimates(file(rows())), ones()).items()}
    expected = {"no_estimate": 0, "test_samples": 20, "auroc_failed": 1, "spearman_error": 1}
    expected |= {f"nne_{TRUTH}": 2, f"nees_{TRUTH}": 2, f"coverage_{TRUTH}": 1}
    for k, kind in enumerate(KINDS):
        expected |= {f"kl_rotation_{kind}": 2 + k, f"kl_translation_{kind}": 3 + k, f"nne_{kind}": 3}
        expected |= {f"nees_{kind}": 1 + k, f"coverage_{kind}": 0.9 - 0.1 * k}
    assert metrics == pytest.approx(expected)
    found = read_estimates(file(rows()))
    assert covariance_of(found.iloc[0]) == pytest.approx(SIGMA, abs=1e-12)
    assert found["failed"].tolist() == [False] * 10 + [True] * 10


def test_means_leave_out_a_tenth_at_either_end_by_weight():
    values = np.random.default_rng(0).normal(size=30) ** 3
    assert trimmed_mean(pd.Series(values), ones(30))[0] == pytest.approx(trim_mean(values, 0.1))
    twice = trimmed_mean(pd.Series(values), 2.0 * (np.arange(30) < 10)[None])[0]
    assert twice == pytest.approx(trim_mean(np.repeat(values[:10], 2), 0.1))
    assert trimmed_mean(pd.Series([1.0, np.nan, 3.0]), ones(3))[0] == pytest.approx(2)
    assert np.isnan(trimmed_mean(pd.Series([np.nan]), ones(1))[0])


def test_of_gaussian_errors_a_right_covariance_scores_right():
    random = np.random.default_rng(0)
    errors = random.multivariate_normal(np.zeros(6), SIGMA, size=4000)
    squares = np.einsum("ni,ij,nj->n", errors, np.linalg.inv(SIGMA), errors)
    right = rows(4000, mahalanobis=squares, error_ratio=np.square(errors).sum(axis=1) / np.trace(SIGMA))
    metrics = measure(right, ones(4000))
    assert metrics[f"coverage_{TRUTH}"][0] == pytest.approx(0.95, abs=0.01)
    # The distribution is skewed, so that its middle lies below its mean.
    assert metrics[f"nees_{TRUTH}"][0] == pytest.approx(0.93, abs=0.02)
    assert metrics[f"nne_{TRUTH}"][0] == pytest.approx(0.96, abs=0.04)


def test_what_has_no_estimate_is_counted_and_left_out_of_the_rest(file):
    some = without(rows(spread=np.linspace(0.2, 0.02, 20)), slice(0, 3))
    metrics = measure(read_estimates(file(some)), ones())
    assert metrics["no_estimate"] == pytest.approx(0.2)
    assert metrics["test_samples"] == 20
    assert metrics["auroc_failed"] == 0
    assert metrics["spearman_error"] == pytest.approx(-1)
    none = measure(read_estimates(file(without(rows(), slice(None)))), ones())
    assert {name: value[0] for name, value in none.items()} == {"no_estimate": 1, "test_samples": 20}


def test_failed_and_other_registrations_stand_apart_and_what_is_not_defined_has_no_row(file):
    wrong = rows(mahalanobis=np.where(np.arange(20) < 10, 1.0, 100.0))
    tidy = estimators.collect_estimates(RUN, [file(wrong)]).set_index(["metric", "concept"])["value"]
    assert tidy[f"coverage_{TRUTH}", "point_to_point/succeeded"] == 1
    assert tidy[f"coverage_{TRUTH}", "point_to_point/failed"] == 0
    assert tidy["test_samples", "point_to_point/failed"] == 10
    assert tidy["auroc_failed", "point_to_point/both"] == 1
    assert ("auroc_failed", "point_to_point/failed") not in tidy.index
    assert (f"coverage_{TRUTH}", "point_to_point/both") not in tidy.index
    tidy = estimators.collect_estimates(RUN, [file(rows(failed=False))])
    assert "auroc_failed" not in set(tidy["metric"])
    assert set(tidy["source"]) | set(tidy["method"]) == {"ycb", "brossard"}
    assert set(tidy["seed"]) == {3}
    without_reference = rows(kl_rotation_data=np.nan, covered_data=np.nan)
    metrics = set(estimators.collect_estimates(RUN, [file(without_reference)])["metric"])
    assert not {"kl_rotation_data", "coverage_data"} & metrics
    assert "kl_rotation_all" in metrics


def intervals_of(file, **of_estimators):
    """Of two sources and two seeds."""
    paths = [
        file(frame, f"{source}/{name}/seed{seed}.csv")
        for name, frame in {REFERENCES[0]: rows(), **of_estimators}.items()
        for source in ("cups", "ycb")
        for seed in (0, 1)
    ]
    return estimators.collect_intervals(RUN, paths)


def test_intervals_are_over_all_sources_and_seeds(file, tmp_path):
    of_brossard = rows(mahalanobis=np.where(np.arange(20) % 3, 1.0, 100.0))
    collected = intervals_of(file, brossard=of_brossard)
    write_csv(tmp_path / "intervals.csv", collected)
    found = read_intervals(tmp_path / "intervals.csv")
    of = found[found["estimator"] == "brossard"].set_index(["state", "metric"])
    row = of.loc["succeeded", f"coverage_{TRUTH}"]
    assert (row["samples"], row["seeds"], row["value"]) == (40, 2, pytest.approx(0.6))
    assert row["low"] < 0.6 < row["high"]
    assert of.loc[("failed", "no_estimate"), "value"] == 0
    assert intervals_of(file, brossard=of_brossard).equals(collected)


def test_an_area_is_compared_with_the_best_gate_on_the_same_draws(file):
    """The residual tells all, the spread of the starts half, the estimator nothing."""
    spread = {"brossard": np.ones(20), "monte_carlo": np.where(np.arange(20) >= 15, 1.0, 0.5)}
    found = intervals_of(file, **{name: rows(spread=values) for name, values in spread.items()})
    of = found[found["metric"] == "auroc_failed"].set_index("estimator")
    expected = {REFERENCES[0]: 1, "brossard": 0.5, "monte_carlo": 0.75, "gate_rmse": 1, "gate_fitness": 0.5}
    assert of["value"].to_dict() == pytest.approx(expected)
    assert of.loc["brossard", ["rival", "difference", "difference_high"]].tolist() == ["gate_rmse", -0.5, -0.5]
    assert of.loc["gate_rmse", ["rival", "difference"]].tolist() == ["monte_carlo", 0.25]
    assert set(found[found["estimator"] == "gate_rmse"]["metric"]) == {"auroc_failed", "spearman_error"}


def test_a_registration_without_correspondences_scores_worst_and_few_families_have_no_interval(file):
    lost = rows(fitness=np.where(np.arange(20) == 19, 0.0, 0.9), inlier_rmse=np.where(np.arange(20) == 19, 0.0, 0.01))
    found = estimators.collect_intervals(RUN, [file(lost, f"ycb/{REFERENCES[0]}/seed0.csv")])
    of = found.set_index(["estimator", "metric"])
    assert of.loc[("gate_rmse", "auroc_failed"), "value"] == pytest.approx(0.55)
    found = intervals_of(file, brossard=rows(cluster="cups"), **{REFERENCES[0]: rows(cluster="cups")})
    assert found["low"].isna().all()


def test_seconds_are_medians_over_all_files(file):
    first = pd.DataFrame({"sample": [0, 1, 2], "method": "point_to_point", "seconds": [0.1, 0.2, 9.0]})
    other = pd.DataFrame({"sample": [0, 1], "method": "point_to_point", "seconds": [0.3, 0.4]})
    files = [file(first, "ycb/estimator_brossard/seed3.csv"), file(other, "ycb/estimator_brossard/seed4.csv")]
    assert collect_estimate_seconds(files).to_numpy().tolist() == [["brossard", "point_to_point", 0.3]]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mahalanobis": "many"}, "column 'mahalanobis' contains values that are not finite numbers"),
        ({"add_relative": ""}, "column 'add_relative'"),
        ({"inlier_rmse": ""}, "column 'inlier_rmse'"),
    ],
)
def test_a_faulty_file_is_one_line(file, changes, message):
    with pytest.raises(InputError, match=message):
        read_estimates(file(rows(**changes)))
