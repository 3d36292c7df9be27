"""What is taken from a run, and with which interval."""

import json
import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from gpca.comparison.values import measured_on, read_results, value_of_run
from gpca.errors import InputError

from .made_up import ACCURACY, LABELS, TIME, compared, number, runtime, tidy


def test_the_mean_and_its_interval_come_in_the_printed_unit():
    found = value_of_run(number(), {"metrics.csv": tidy([0.90, 0.92, 0.94])})
    assert (found.value, found.n) == (pytest.approx(92), 3)
    assert found.high - found.value == pytest.approx(4.30265 * 2 / np.sqrt(3), rel=1e-5)
    assert value_of_run(number(), {"metrics.csv": tidy([0.9, 0.99, 1.0])}).high == 100


def test_shares_of_a_confusion_are_ratios_seed_by_seed():
    rows = pd.concat(
        [
            tidy([20, 30], metric="predicted_as_pose", concept="overlap"),
            tidy([100, 60], metric="test_samples", concept="overlap"),
            tidy([1, 1], metric="test_samples"),
        ]
    )
    counterpart = replace(ACCURACY, metrics=("predicted_as_pose", "test_samples"), concept="overlap")
    assert value_of_run(number(counterpart=counterpart), {"metrics.csv": rows}).value == pytest.approx(35)


def test_several_sources_are_averaged_seed_by_seed():
    rows = pd.concat([tidy([0.9, 0.9]), tidy([0.7, 0.5], source="linemod")])
    found = value_of_run(number(counterpart=replace(ACCURACY, sources=("ycb", "linemod"))), {"metrics.csv": rows})
    assert found.value == pytest.approx(75)
    assert found.n == 2
    assert value_of_run(number(counterpart=replace(ACCURACY, sources=("ycb", "cups"))), {"metrics.csv": rows}) is None


def test_a_deviation_has_the_interval_of_its_chi_square():
    from scipy.stats import chi2

    values = np.array([0.80, 0.82, 0.84, 0.86, 0.88])
    found = value_of_run(number(counterpart=replace(ACCURACY, statistic="deviation")), {"metrics.csv": tidy(values)})
    assert found.value == pytest.approx(100 * values.std(ddof=1))
    assert chi2.cdf(4 * (found.value / found.high) ** 2, 4) == pytest.approx(0.025)
    assert chi2.cdf(4 * (found.value / found.low) ** 2, 4) == pytest.approx(0.975)
    assert (
        value_of_run(number(counterpart=replace(ACCURACY, statistic="deviation")), {"metrics.csv": tidy([0.8])}) is None
    )


def test_labels_of_runs_that_missed_the_target_are_a_lower_bound():
    table = {"method": "random", "concept": "overlap", "table": "active_learning/pretrained"}
    labels = tidy([60, 20], metric="labels_to_target", **table)
    rows = pd.concat([labels, tidy([0, 1], metric="reached", **table)])
    printed = number(350, 550, -1, "labels", LABELS)
    found = value_of_run(printed, {"active_learning.csv": rows})
    assert (found.value, found.at_least, math.isnan(found.low)) == (40, True, True)
    [row] = compared([printed], {"active_learning.csv": rows}).itertuples()
    assert (row.verdict, row.at_least) == ("inconclusive", True)
    assert "lower bound" in row.reason
    rows = pd.concat([labels, tidy([1, 1], metric="reached", **table)])
    assert not value_of_run(printed, {"active_learning.csv": rows}).at_least


def test_times_of_components_add_up():
    printed = number(4.2, unit="s", counterpart=TIME)
    results = {"runtime.csv": runtime(icp=3.0, features=1.0, scores=7.0)}
    found = value_of_run(printed, results)
    assert (found.value, found.n) == (pytest.approx(4.0), 100)
    assert found.high - found.value == pytest.approx(1.98422 * np.sqrt(0.3**2 + 0.1**2) / 10, rel=1e-5)
    assert value_of_run(printed, {"runtime.csv": runtime(icp=3.0)}) is None
    [row] = compared([printed], results).itertuples()
    assert (row.verdict, row.hardware, row.objects) == ("reproduced", "A processor", "MODEL")
    assert row.factor == pytest.approx(4.0 / 4.2)


def test_times_per_sample_name_the_processor_of_their_record(tmp_path):
    path = tmp_path / "timings.csv"
    assert measured_on([path]) == ""
    (tmp_path / "timings.csv.provenance.json").write_text(json.dumps({"device": {"name": "Some cores"}}))
    assert measured_on([tmp_path / "metrics.csv", path]) == "Some cores"
    counterpart = replace(ACCURACY, file="timings.csv", metrics=("seconds_per_sample",))
    rows = {"timings.csv": tidy([2.9, 3.0, 3.1], metric="seconds_per_sample")}
    [row] = compared([number(2, 4, 0, "s", counterpart)], rows, hardware="Some cores").itertuples()
    assert (row.verdict, row.hardware) == ("reproduced", "Some cores")


def test_a_results_file_that_is_none_is_refused(tmp_path):
    (tmp_path / "metrics.csv").write_text("table,source\n")
    with pytest.raises(InputError, match=r"metrics\.csv"):
        read_results([tmp_path / "metrics.csv"])
