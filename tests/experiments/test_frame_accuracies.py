"""Accuracies on depth frames, by seed and with intervals over scenes."""

import numpy as np
import pandas as pd
import pytest

from gpca.declarations.plan import Run
from gpca.evaluation.intervals import wilson_interval
from gpca.evaluation.measures import ALL, read_clustered, write_metrics
from gpca.experiments.frame_tables import collect, collect_intervals
from gpca.experiments.frames import read_together
from gpca.frames.source import ONE_ENCODER, REAL_WORLD
from gpca.io.csv_file import write_csv

RUN = Run({"real_world": {"backbones": ["dgcnn", "pointnet"], "reductions": ["none"]}})
TRUE = ["noise", "pose", "overlap", "noise"]
NAMED = ["noise", "pose", "noise", "pose"]


def predictions(folder, source, method="dgcnn-none"):
    rows = {"sample": range(4), "split": "test", "object": ["a", "a", "b", "b"], "cluster": "lm 6"}
    rows |= {"concept_true": TRUE, "concept_predicted": NAMED, "abstained": False, "icp_calls": 0}
    rows |= {f"score_{c}": [0.8 if name == c else 0.1 for name in NAMED] for c in ("noise", "pose", "overlap")}
    return written(folder / "predictions" / source / method / "seed0.csv", rows)


def poses(folder, source=REAL_WORLD, **changes):
    rows = {"sample": range(4), "split": "test", "instance": range(4), "dataset": ["lm", "lm", "lm", "ycbv"]}
    rows |= {"in_training": [True, True, False, False]}
    return written(folder / "poses" / source / "seed0.csv", rows | changes)


def written(path, rows):
    path.parent.mkdir(parents=True, exist_ok=True)
    pd.DataFrame(rows).to_csv(path, index=False)
    return path


def test_seen_unseen_and_datasets_are_judged_apart(tmp_path):
    one = predictions(tmp_path, ONE_ENCODER)
    metrics = collect(RUN, [predictions(tmp_path, REAL_WORLD)], [poses(tmp_path)], [one])
    accuracy = metrics[(metrics["metric"] == "accuracy") & (metrics["concept"] == ALL)]
    of_table = accuracy[accuracy["source"] == REAL_WORLD].set_index("table")["value"].to_dict()
    assert of_table == {
        "attribution": 0.5, "seen": 1.0, "unseen": 0.0, "dataset/lm": pytest.approx(2 / 3), "dataset/ycbv": 0.0
    }  # fmt: skip
    assert accuracy[accuracy["source"] == ONE_ENCODER]["table"].tolist() == ["attribution"]
    ece = metrics[(metrics["metric"] == "ece") & (metrics["table"] == "seen")]["value"]
    assert ece.tolist() == [pytest.approx(0.2)]
    proper = metrics[metrics["table"] == "unseen"].set_index("metric")["value"]
    assert proper["nll"] == pytest.approx(-np.log(0.1))
    assert proper["brier"] == pytest.approx(0.8**2 + 0.9**2 + 0.1**2)
    write_metrics(metrics, tmp_path / "real_world.csv")
    together = read_together(tmp_path / "real_world.csv")
    assert set(together["table"]) == {"attribution"}
    assert set(together["source"]) == {REAL_WORLD}


CONCEPTS = ("noise", "pose", "overlap")


def twelve(wrong):
    """Twelve samples in four scenes, of which some are named wrongly."""
    rows = []
    for sample in range(12):
        true = CONCEPTS[sample % 3]
        named = "pose" if sample in wrong and true != "pose" else "noise" if sample in wrong else true
        known = {"sample": sample, "split": "test", "object": "a", "cluster": f"lm {sample // 3}"}
        told = {"concept_true": true, "concept_predicted": named, "abstained": False, "icp_calls": 0}
        rows.append(known | told | {f"score_{concept}": float(concept == named) for concept in CONCEPTS})
    return pd.DataFrame(rows)


@pytest.fixture
def files(tmp_path):
    said, poses = [], []
    for seed in range(2):
        for method, wrong in {"dgcnn-none": {0, 1, 2, 3}, "pointnet-none": {0, 1, 2, 3, 6, 7}}.items():
            said.append(tmp_path / f"predictions/{REAL_WORLD}/{method}/seed{seed}.csv")
            write_csv(said[-1], twelve(wrong))
        poses.append(tmp_path / f"poses/{REAL_WORLD}/seed{seed}.csv")
        number = np.arange(12)
        rows = {"sample": number, "split": "test", "instance": number, "in_training": number < 6}
        write_csv(poses[-1], pd.DataFrame(rows | {"dataset": np.where(number < 9, "lm", f"of_{seed}")}))
    return said, poses


def test_values_are_those_of_the_metrics_over_scenes_and_differences_are_paired(files, tmp_path):
    write_csv(tmp_path / "intervals.csv", collect_intervals(RUN, *files), form=None)
    found = read_clustered(tmp_path / "intervals.csv").set_index(["table", "method", "metric", "concept"])
    metrics = collect(RUN, *files)
    metrics = metrics[(metrics["metric"] == "accuracy")].groupby(["table", "method", "metric", "concept"])["value"]
    accuracies = found.xs("accuracy", level="metric", drop_level=False)
    for key in accuracies.index:
        assert accuracies.loc[key, "value"] == pytest.approx(metrics.mean()[key])
    tables = {table for table, *_ in found.index}
    assert tables == {"attribution", "seen", "unseen", "dataset/lm", "dataset/of_0", "dataset/of_1"}
    row = found.loc["attribution", "dgcnn-none", "accuracy", "all"]
    assert (row["seeds"], row["clusters"], row["samples"]) == (2, 4, 24)
    assert row["low"] < row["value"] < row["high"]
    seldom = found.loc["dataset/of_1", "dgcnn-none", "accuracy", "all"]
    assert (seldom["seeds"], seldom["clusters"], seldom["samples"]) == (1, 1, 3)
    assert (seldom["value"], seldom["low"], seldom["high"]) == pytest.approx((1, *wilson_interval(1, 1)))
    row = found.loc["attribution", "pointnet-none", "difference", "all"]
    assert row["value"] == pytest.approx(-2 / 12) and row["low"] < row["value"] < row["high"] <= 0
    assert ("attribution", "dgcnn-none", "difference", "all") not in found.index


def test_a_method_of_fewer_seeds_is_compared_in_these_and_faults_are_one_line(files):
    said, poses = files
    first_alone = collect_intervals(RUN, said[:2], poses[:1])
    fewer = collect_intervals(RUN, [path for path in said if path != said[3]], poses)
    of = {"method": "pointnet-none", "table": "attribution", "concept": "all"}
    for rows in (first_alone, fewer):
        told = rows[(rows[list(of)] == list(of.values())).all(axis=1)].set_index("metric")
        assert told.loc["difference", "value"] == pytest.approx(-2 / 12)
        assert told["seeds"].tolist() == [1, 1]
