"""Accuracies on depth frames with intervals over scenes."""

import numpy as np
import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.evaluation.intervals import wilson_interval
from gpca.evaluation.measures import read_clustered
from gpca.experiments.real_world.intervals import collect_intervals
from gpca.experiments.real_world.metrics import collect
from gpca.frames.source import REAL_WORLD
from gpca.io.csv_file import write_csv

CONCEPTS = ("noise", "pose", "overlap")


def predictions(wrong):
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
            write_csv(said[-1], predictions(wrong))
        poses.append(tmp_path / f"poses/{REAL_WORLD}/seed{seed}.csv")
        number = np.arange(12)
        rows = {"sample": number, "split": "test", "instance": number, "in_training": number < 6}
        write_csv(poses[-1], pd.DataFrame(rows | {"dataset": np.where(number < 9, "lm", f"of_{seed}")}))
    return said, poses


@pytest.fixture
def found(files, tmp_path):
    write_csv(tmp_path / "intervals.csv", collect_intervals(*files, "dgcnn-none"), form=None)
    return read_clustered(tmp_path / "intervals.csv").set_index(["table", "method", "metric", "concept"])


def test_values_are_those_of_the_metrics(files, found):
    metrics = collect(*files)
    metrics = metrics[(metrics["metric"] == "accuracy")].groupby(["table", "method", "metric", "concept"])["value"]
    accuracies = found.xs("accuracy", level="metric", drop_level=False)
    for key in accuracies.index:
        assert accuracies.loc[key, "value"] == pytest.approx(metrics.mean()[key])
    tables = {table for table, *_ in found.index}
    assert tables == {"attribution", "seen", "unseen", "dataset/lm", "dataset/of_0", "dataset/of_1"}


def test_clusters_are_scenes(found):
    row = found.loc["attribution", "dgcnn-none", "accuracy", "all"]
    assert (row["seeds"], row["clusters"], row["samples"]) == (2, 4, 24)
    assert row["low"] < row["value"] < row["high"]
    seldom = found.loc["dataset/of_1", "dgcnn-none", "accuracy", "all"]
    assert (seldom["seeds"], seldom["clusters"], seldom["samples"]) == (1, 1, 3)
    assert (seldom["value"], seldom["low"], seldom["high"]) == pytest.approx((1, *wilson_interval(1, 1)))


def test_differences_are_paired_with_the_first_method(found):
    row = found.loc["attribution", "pointnet-none", "difference", "all"]
    assert row["value"] == pytest.approx(-2 / 12) and row["low"] < row["value"] < row["high"] <= 0
    assert ("attribution", "dgcnn-none", "difference", "all") not in found.index


def test_a_method_of_fewer_seeds_is_compared_in_these(files):
    said, poses = files
    first_alone = collect_intervals(said[:2], poses[:1], "dgcnn-none")
    fewer = collect_intervals([path for path in said if path != said[3]], poses, "dgcnn-none")
    of = {"method": "pointnet-none", "table": "attribution", "concept": "all"}
    for rows in (first_alone, fewer):
        told = rows[(rows[list(of)] == list(of.values())).all(axis=1)].set_index("metric")
        assert told.loc["difference", "value"] == pytest.approx(-2 / 12)
        assert told["seeds"].tolist() == [1, 1]


def test_faults_are_one_line(files):
    said, poses = files
    with pytest.raises(InputError, match="no files were given"):
        collect_intervals([], poses, "dgcnn-none")
    with pytest.raises(InputError, match="has no pose file beside it"):
        collect_intervals(said, poses[1:], "dgcnn-none")
