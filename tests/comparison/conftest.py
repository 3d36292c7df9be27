"""A small run and its reference, and how their files are written."""

import csv
import json
import shutil

import pytest
import yaml

from gpca.evaluation.measures import TIDY_COLUMNS as TIDY
from gpca.process.code_files import ROOT
from gpca.process.processor import describe

SETTINGS = yaml.safe_load((ROOT / "config/config.yaml").read_text())["reference"]
HEADS = ("source", "explainer", "mean", "ci_low", "ci_high", "n_seeds", "n_test", "at_least")


def write(path, heads, rows):
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([heads, *rows])


def tidy_rows(metric, *values, method="gpca"):
    return [("attribution", "ycb", method, metric, "all", seed, value) for seed, value in enumerate(values)]


@pytest.fixture
def folders(tmp_path):
    """A run `tiny` and its reference, which are the same: metrics, one table, and times."""
    there = tmp_path / "results/reference/tiny"
    rows = (
        tidy_rows("accuracy", 0.90, 0.90)
        + tidy_rows("test_samples", 100, 100)
        + tidy_rows("predicted_as_noise", 50, 50)
        + tidy_rows("accuracy", 0.8, 0.9, method="b")
    )
    write(there / "metrics.csv", TIDY, rows)
    write(there / "timings.csv", TIDY, tidy_rows("seconds_per_sample", 1.0))
    write(
        there / "tables/table1.csv",
        HEADS,
        [("ycb", "gpca", 90.0, 88.0, 92.0, 5, 100, False), ("ycb", "b", 50.0, "", "", 1, 100, False)],
    )
    write(there / "comparison.csv", ("table", "row"), [("I", "YCB")])
    for file in ("metrics.csv", "tables/table1.csv"):
        record = {"config_sha256": {"seeds": "c0ffee"}, "device": describe() | {"name": "A processor"}}
        (there / f"{file}.provenance.json").write_text(json.dumps(record))
    here = tmp_path / "results/tiny"
    shutil.copytree(there, here)
    return here, there
