"""Diagnostics of learners on samples like and unlike the training, by seed and with intervals, and Table V."""

import numpy as np
import pandas as pd
import pytest

from gpca.attribution import diagnostics
from gpca.attribution.learner_predictions import read_learner_predictions
from gpca.errors import InputError
from gpca.evaluation.measures import COLUMNS, read_clustered
from gpca.experiments.out_of_distribution import (
    RHO,
    SHIFTED,
    TABLE,
    collect,
    samples_of_seed,
    table5_learners,
    table5_shift,
)
from gpca.io.csv_file import write_csv
from gpca.pairs.shifted_sets import DISTANCES
from gpca.steps.shift import predict_sets

from ..pairs.test_shifted_sets import sets
from ..steps.test_shift import quick
from .runs import run_with

OTHER = {"noise": "pose", "pose": "overlap", "overlap": "noise"}


def written(folder, change=lambda rows, seed: rows):
    """Predictions of two seeds of a GPC, with a change, and the sets that they are of."""
    predictions, set_files, rows = [], [], predict_sets(quick, sets())
    for seed in (0, 1):
        (path := folder / "shifted/cups" / f"seed{seed}.npz").parent.mkdir(parents=True, exist_ok=True)
        sets().save(path, ("tiny", 0))
        set_files.append(path)
        predictions.append(folder / "learners/cups/gpca" / f"seed{seed}.csv")
        write_csv(predictions[-1], change(rows, seed))
    return predictions, set_files


@pytest.fixture
def files(tmp_path):
    return written(tmp_path)


def edited(path, change):
    rows = pd.read_csv(path)
    change(rows)
    write_csv(path, rows)


def value(metrics, of_set, metric, seed=0):
    chosen = (metrics["table"] == TABLE + of_set) & (metrics["metric"] == metric) & (metrics["seed"] == seed)
    [found] = metrics.loc[chosen, "value"]
    return found


def test_sets_have_finite_diagnostics_by_their_definitions_within_bounds(files):
    metrics = collect(None, *files)[0]
    assert set(metrics["table"]) == {
        TABLE + name
        for name in ("in_distribution", "severity", "seen_objects", "objects", "in_distribution+severity",
                     "seen_objects+objects")
    }  # fmt: skip
    assert np.isfinite(metrics["value"]).all()
    assert not metrics.duplicated(["table", "metric", "seed"]).any()
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


def test_a_learner_without_bald_has_none_of_its_diagnostics(files):
    predictions, set_files = files
    for path in predictions:
        edited(path, lambda rows: rows.__setitem__(["bald", *rows.filter(like="variance_").columns], np.nan))
    metrics = set(collect(None, predictions, set_files)[0]["metric"])
    assert "aurc_entropy" in metrics
    assert not [name for name in metrics if "bald" in name or "variance" in name]


@pytest.mark.parametrize("right", [True, False])
def test_all_right_or_all_wrong_is_finite(files, right):
    predictions, set_files = files
    for path in predictions:
        rows = pd.read_csv(path)
        predicted = rows["concept_predicted"]
        write_csv(path, rows.assign(concept_true=predicted if right else predicted.map(OTHER)))
    metrics = collect(None, predictions, set_files)[0]
    assert np.isfinite(metrics["value"]).all()
    assert value(metrics, "severity", "aurc_max_score") == (0 if right else 1)
    assert value(metrics, "severity", "excess_aurc_max_score") == pytest.approx(0)


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
        collect(None, predictions, set_files)[0]


@pytest.fixture(scope="module")
def files_of_families(tmp_path_factory):
    """Predictions of two families, of which one is harder in the second seed."""

    def change(rows, seed):
        family = np.where(rows["sample"] % 2 == 0, "mug", "bowl")
        wrong = (family == "mug") & (seed == 1) & (rows["sample"] % 4 == 0)
        named = rows["concept_predicted"].where(~wrong, rows["concept_true"].map(OTHER))
        return rows.assign(cluster=family, concept_predicted=named)

    return written(tmp_path_factory.mktemp("learners"), change)


@pytest.fixture(scope="module")
def found(files_of_families, tmp_path_factory):
    path = tmp_path_factory.mktemp("intervals") / "learner_intervals.csv"
    write_csv(path, collect(None, *files_of_families)[1], form=None)
    return read_clustered(path).set_index(["table", "metric"])


def test_values_are_those_of_the_diagnostics_within_their_intervals_and_limits(files_of_families, found):
    metrics = collect(None, *files_of_families)[0]
    mean = metrics.groupby(["table", "metric"])["value"].mean()
    for key in found.index:
        assert found.loc[key, "value"] == pytest.approx(mean[key])
    assert ("learners/in_distribution+severity", RHO) in found.index
    assert ("learners/severity", "aurc_max_score") in found.index
    rows = found[(found["value"] > 0) & (found["value"] < 1)]
    assert (rows["low"] <= rows["value"]).all() and (rows["value"] <= rows["high"]).all()
    assert (rows["low"] < rows["high"]).all()
    areas = found.xs("ece", level="metric")
    assert (areas["low"] >= 0).all() and (areas["high"] <= 1).all()
    assert (found["seeds"] == 2).all() and (found["clusters"] == 2).all()


VALUES = {  # learner -> accuracy, ρ, area, ECE
    "gpca": (0.96, 0.52, 0.004, 0.05),
    "learner_forest": (0.95, 0.12, 0.010, 0.10),
    "learner_linear_svm": (0.99, 0.51, 0.020, 0.02),
}


@pytest.fixture
def numbers():
    """Return intervals of three learners on YCB, over three seeds, on every set and pair of sets."""
    joined = {"severity": "in_distribution+severity", "source": "in_distribution+source",
              "objects": "seen_objects+objects"}  # fmt: skip
    rows = []

    def add(of_set, learner, metric, value, samples=120):
        own = (f"learners/{of_set}", "ycb", learner, metric, "all", 3, 11, samples)
        rows.append((*own, value, 0.9 * value, 1.01 * value))

    for learner, (accuracy, rho, area, ece) in VALUES.items():
        for of_set in ("in_distribution", "seen_objects", *SHIFTED):
            values = {"accuracy": accuracy, "ece": ece, RHO: rho}
            values |= {f"{name}_max_score": area for name in ("aurc", "excess_aurc", "augrc")}
            for metric, value in values.items():
                add(of_set, learner, metric, value)
        for of_set in joined.values():
            add(of_set, learner, RHO, rho, 240)
    return pd.DataFrame(rows, columns=list(COLUMNS))


LEARNERS = dict.fromkeys(VALUES)
REAL = run_with(
    sources={"ycb": {"title": "YCB", "kind": "bop"}, "linemod": {"title": "LINEMOD", "kind": "bop"}}, learners=LEARNERS
)
OVER_FAMILIES = "in brackets: the 95 % interval of a bootstrap over families of objects and seeds"


def test_table5_shows_accuracy_and_diagnostics_and_marks_the_best(numbers):
    markdown = table5_learners(REAL, numbers).markdown()
    assert "| Dataset | Learner | Accuracy (%) | ρ | AURC | E-AURC | AUGRC | ECE (share) |" in markdown
    numbers_of_row = "96.0 (86.4 to 97.0) | **0.520 (0.468 to 0.525)** | **0.0040 (0.0036 to 0.0040)** |"
    assert f"| YCB | GP-CA (trained longer) | {numbers_of_row}" in markdown
    assert "**99.0 (89.1 to 100.0)**" in markdown
    assert "**0.020 (0.018 to 0.020)**" in markdown
    assert "LINEMOD" not in markdown
    assert f"Over 3 seeds; {OVER_FAMILIES}" in markdown


def test_tables5_have_every_kind_of_shift_and_name_the_samples_of_each(numbers):
    table = table5_shift(REAL, numbers)
    assert [key for key in table.columns if key.startswith("rho")] == ["rho_severity", "rho_source", "rho_objects"]
    titles = [column.title for column in table.columns.values()]
    assert len(set(titles)) == len(titles)
    assert table.cells[0, "rho_objects"].test_samples == 3 * (40 + 40)
    assert table.cells[0, "accuracy_objects"].test_samples == 3 * 40
    assert samples_of_seed(numbers, "ycb", "objects") == 40
    note = table5_learners(REAL, numbers[numbers["table"] != "learners/severity"]).footnotes[0]
    assert "40 in distribution, 40 source, 40 seen objects, 40 objects" in note and "severity" not in note
