"""Accuracies with intervals over families of objects."""

import numpy as np
import pandas as pd
import pytest

from gpca.attribution.metrics import collect
from gpca.errors import InputError
from gpca.evaluation.intervals import wilson_interval
from gpca.evaluation.measures import read_clustered
from gpca.experiments.concept_attribution.intervals import collect_intervals
from gpca.io.csv_file import write_csv

CONCEPTS = ("noise", "pose", "overlap")
TURNED = {"noise": "pose", "pose": "overlap", "overlap": "noise"}


def predictions(seed):
    """Samples of four families, of which one is always misnamed, and a second with the second seed."""
    rows = []
    for sample in range(24):
        true, family = CONCEPTS[sample % 3], f"family {sample // 3 % 4}"
        wrong = family == "family 0" or (family == "family 1" and seed == 1)
        known = {"sample": sample, "split": "test", "object": family, "cluster": family, "concept_true": true}
        named = "" if sample == 0 else TURNED[true] if wrong else true
        scores = {f"score_{concept}": float(concept == named) for concept in CONCEPTS}
        rows.append(known | {"concept_predicted": named, "abstained": named == "", "icp_calls": 0} | scores)
    rows.append(rows[3] | {"sample": 99, "split": "train"})
    return pd.DataFrame(rows)


@pytest.fixture
def files(tmp_path):
    given, causal = [], []
    for seed in range(2):
        given.append(tmp_path / f"predictions/ycb/gpca/seed{seed}.csv")
        write_csv(given[-1], predictions(seed))
        causal.append(tmp_path / f"uncertainty/ycb/causal/seed{seed}.csv")
        rows = predictions(seed)[["sample", "split"]]
        observed = np.where(rows["sample"] % 2 == 0, 2.0, 0.0)
        write_csv(causal[-1], rows.assign(uncertainty_observed=observed, uncertainty_clean=1.0))
    return given, causal


@pytest.fixture
def found(files, tmp_path):
    write_csv(tmp_path / "intervals.csv", collect_intervals(*files), form=None)
    return read_clustered(tmp_path / "intervals.csv").set_index(["metric", "concept"])


def test_values_are_those_of_the_metrics(files, found):
    metrics = collect(*files).groupby(["metric", "concept"])["value"].mean()
    assert set(found.index) == {
        *(("accuracy", concept) for concept in ("all", *CONCEPTS)),
        ("permuted_accuracy", "all"),
        ("causal_accuracy", "all"),
    }
    for key in found.index:
        assert found.loc[key, "value"] == pytest.approx(metrics[key])
    assert found.loc[("causal_accuracy", "all"), "samples"] == 24


def test_intervals_are_over_families_and_seeds(found):
    row = found.loc["accuracy", "all"]
    assert (row["seeds"], row["clusters"], row["samples"]) == (2, 4, 48)
    assert row["high"] - row["low"] > 1.5 * np.ptp(wilson_interval(30, 48))  # far more than of independent samples
    assert ((found["low"] < found["value"]) & (found["value"] < found["high"])).all()


def test_faults_are_one_line(files):
    given, causal = files
    with pytest.raises(InputError, match="no files were given"):
        collect_intervals([])
    write_csv(causal[0], pd.read_csv(causal[0]).iloc[3:])
    with pytest.raises(InputError, match="lacks samples of"):
        collect_intervals(given, causal)
    write_csv(given[1], predictions(1).iloc[-1:])
    with pytest.raises(InputError, match="has no test rows"):
        collect_intervals(given)
