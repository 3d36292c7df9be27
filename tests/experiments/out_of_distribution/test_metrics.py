import numpy as np
import pandas as pd
import pytest

from gpca.attribution import diagnostics
from gpca.errors import InputError
from gpca.experiments.out_of_distribution.learners import predict_sets
from gpca.experiments.out_of_distribution.metrics import (
    TABLE,
    collect_diagnostics,
    read_learner_predictions,
    uncertainty_metrics,
)
from gpca.experiments.out_of_distribution.sets import DISTANCES
from gpca.io.csv_file import write_csv
from tests.experiments.out_of_distribution.test_learners import quick
from tests.experiments.out_of_distribution.test_sets import sets


@pytest.fixture
def files(tmp_path):
    """Predictions of two seeds of a GPC and the sets that they are of."""
    predictions, set_files = [], []
    for seed in (0, 1):
        (path := tmp_path / "shifted/cups" / f"seed{seed}.npz").parent.mkdir(parents=True, exist_ok=True)
        sets().save(path, ("tiny", 0))
        set_files.append(path)
        predictions.append(tmp_path / "learners/cups/gpca" / f"seed{seed}.csv")
        write_csv(predictions[-1], predict_sets(quick, sets()))
    return predictions, set_files


def edited(path, change):
    rows = pd.read_csv(path)
    change(rows)
    write_csv(path, rows)


def value(metrics, of_set, metric, seed=0):
    chosen = (metrics["table"] == TABLE + of_set) & (metrics["metric"] == metric) & (metrics["seed"] == seed)
    [found] = metrics.loc[chosen, "value"]
    return found


def test_every_set_and_pair_of_sets_has_finite_diagnostics(files):
    metrics = collect_diagnostics(*files)
    assert set(metrics["table"]) == {
        TABLE + name
        for name in ("in_distribution", "severity", "seen_objects", "objects", "in_distribution+severity",
                     "seen_objects+objects")
    }  # fmt: skip
    assert np.isfinite(metrics["value"]).all()
    assert not metrics.duplicated(["table", "metric", "seed"]).any()


def test_the_numbers_are_those_of_the_definitions(files):
    metrics = collect_diagnostics(*files)
    [rows] = [rows for (_, _, seed), rows in read_learner_predictions(*files).items() if seed == 0]
    rows = rows[rows["set"] == "severity"]
    p = rows[["score_noise", "score_pose", "score_overlap"]].to_numpy()
    target = rows["concept_true"].map(["noise", "pose", "overlap"].index).to_numpy()
    assert value(metrics, "severity", "accuracy") == np.mean(p.argmax(axis=1) == target)
    assert value(metrics, "severity", "ece") == diagnostics.calibration_error(p, target)
    wrong = p.argmax(axis=1) != target
    assert value(metrics, "severity", "aurc_max_score") == diagnostics.aurc(p.max(axis=1) - 1, wrong)
    assert value(metrics, "severity", "aurc_bald") == diagnostics.aurc(-rows["bald"].to_numpy(), wrong)
    distance = sets().distance[sets().rows("severity", "test"), DISTANCES.index("knn_embedding")]
    rho = diagnostics.rank_correlation(rows["entropy"], distance)
    assert value(metrics, "severity", "rho_entropy_knn_embedding") == rho


def test_intervals_hold_their_value(files):
    metrics = collect_diagnostics(*files)
    for name in ("nll", "brier", f"rho_bald_{DISTANCES[0]}"):
        low, middle, high = (value(metrics, "in_distribution", name + end) for end in ("_low", "", "_high"))
        assert low < middle < high


def test_a_learner_without_bald_has_none_of_its_diagnostics(files):
    predictions, set_files = files
    for path in predictions:
        edited(path, lambda rows: rows.__setitem__(["bald", *rows.filter(like="variance_").columns], np.nan))
    metrics = set(collect_diagnostics(predictions, set_files)["metric"])
    assert "aurc_entropy" in metrics
    assert not [name for name in metrics if "bald" in name or "variance" in name]


@pytest.mark.parametrize("right", [True, False])
def test_all_right_or_all_wrong_is_finite(files, right):
    predictions, set_files = files
    for path in predictions:
        edited(path, lambda rows: rows.__setitem__(
            "concept_true", rows["concept_predicted"] if right else rows["concept_predicted"].map(
                {"noise": "pose", "pose": "overlap", "overlap": "noise"})))  # fmt: skip
    metrics = collect_diagnostics(predictions, set_files)
    assert np.isfinite(metrics["value"]).all()
    assert value(metrics, "severity", "aurc_max_score") == (0 if right else 1)
    assert value(metrics, "severity", "excess_aurc_max_score") == pytest.approx(0)


def test_one_sample_of_a_set_is_finite(files):
    predictions, set_files = files
    for path in predictions:
        rows = pd.read_csv(path)
        write_csv(path, rows[(rows["set"] != "severity") | (rows["sample"] == 3)])
    metrics = collect_diagnostics(predictions, set_files)
    assert np.isfinite(metrics["value"]).all()
    assert value(metrics, "severity", f"rho_max_score_{DISTANCES[0]}") == 0
    assert value(metrics, "severity", "test_samples") == 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda rows: rows.__setitem__("score_pose", 2 * rows["score_pose"] + 0.1), "do not sum to one"),
        (lambda rows: rows.__setitem__("sample", rows["sample"] + 1), "lacks samples of"),
    ],
)
def test_bad_predictions_are_one_line(files, change, message):
    predictions, set_files = files
    edited(predictions[0], change)
    with pytest.raises(InputError, match=message):
        collect_diagnostics(predictions, set_files)


def test_no_files_are_a_fault():
    with pytest.raises(InputError, match="no files were given"):
        collect_diagnostics([], [])


def test_what_grows_with_the_distance_has_rho_one(files):
    [rows, _] = read_learner_predictions(*files).values()
    rows = rows[rows["set"] == "severity"]
    rows = rows.assign(max_score=rows["knn_analytical"] ** 3)
    assert uncertainty_metrics(rows)["rho_max_score_knn_analytical"] == pytest.approx(1)
