"""Diagnostics of learners with intervals over families of objects."""

import numpy as np
import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.evaluation.measures import read_clustered
from gpca.experiments.out_of_distribution.intervals import RHO, clusters_of, collect_intervals
from gpca.experiments.out_of_distribution.learners import predict_sets
from gpca.experiments.out_of_distribution.metrics import collect_diagnostics
from gpca.io.csv_file import write_csv
from tests.experiments.out_of_distribution.test_learners import quick
from tests.experiments.out_of_distribution.test_sets import sets


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Predictions of two seeds of a GPC and the sets that they are of."""
    folder, predictions, set_files = tmp_path_factory.mktemp("learners"), [], []
    rows = predict_sets(quick, sets())
    for seed in (0, 1):
        (path := folder / "shifted/cups" / f"seed{seed}.npz").parent.mkdir(parents=True, exist_ok=True)
        sets().save(path, ("tiny", 0))
        set_files.append(path)
        predictions.append(folder / "learners/cups/gpca" / f"seed{seed}.csv")
        # Two families, of which one is harder in the second seed.
        family = np.where(rows["sample"] % 2 == 0, "mug", "bowl")
        wrong = (family == "mug") & (seed == 1) & (rows["sample"] % 4 == 0)
        named = rows["concept_predicted"].where(~wrong, rows["concept_true"].map(
            {"noise": "pose", "pose": "overlap", "overlap": "noise"}))  # fmt: skip
        write_csv(predictions[-1], rows.assign(cluster=family, concept_predicted=named))
    return predictions, set_files


@pytest.fixture(scope="module")
def found(files, tmp_path_factory):
    path = tmp_path_factory.mktemp("intervals") / "learner_intervals.csv"
    write_csv(path, collect_intervals(*files), form=None)
    return read_clustered(path).set_index(["table", "metric"])


def test_values_are_those_of_the_diagnostics(files, found):
    metrics = collect_diagnostics(*files)
    mean = metrics.groupby(["table", "metric"])["value"].mean()
    for key in found.index:
        assert found.loc[key, "value"] == pytest.approx(mean[key])
    assert ("learners/in_distribution+severity", RHO) in found.index
    assert ("learners/severity", "aurc_max_score") in found.index


def test_intervals_hold_their_value_and_stay_within_its_limits(found):
    rows = found[(found["value"] > 0) & (found["value"] < 1)]
    assert (rows["low"] <= rows["value"]).all() and (rows["value"] <= rows["high"]).all()
    assert (rows["low"] < rows["high"]).all()
    areas = found.xs("ece", level="metric")
    assert (areas["low"] >= 0).all() and (areas["high"] <= 1).all()
    assert (found["seeds"] == 2).all() and (found["clusters"] == 2).all()


def test_no_files_are_a_fault():
    with pytest.raises(InputError, match="no files were given"):
        collect_intervals([], [])


def test_the_other_sources_families_are_its_own():
    rows = pd.DataFrame({"set": ["in_distribution", "source"], "cluster": ["box", "box"]})
    assert clusters_of(rows) == ["box", "other/box"]
