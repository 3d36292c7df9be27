"""What is taken from a run, and with which interval."""

import json
import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import chi2

from gpca.attribution.predictions import PREDICTION_COLUMNS
from gpca.comparison.published import UNITS
from gpca.comparison.values import cluster_draws, folder_behind, folders_behind, measured_on, read_results, value_of_run
from gpca.errors import InputError
from gpca.evaluation.intervals import wilson_interval

from .conftest import write
from .made_up import ACCURACY, LABELS, TIME, TOLERANCES, compared, number, runtime, tidy

CONCEPTS = ("noise", "pose", "overlap")
TAKEN = replace(ACCURACY, metrics=("predicted_as_pose", "test_samples"), concept="overlap")


def test_means_come_in_the_printed_unit_ratios_and_sources_are_taken_seed_by_seed():
    found = value_of_run(number(), {"metrics.csv": tidy([0.90, 0.92, 0.94])})
    assert (found.value, found.n) == (pytest.approx(92), 3)
    assert found.high - found.value == pytest.approx(4.30265 * 2 / np.sqrt(3), rel=1e-5)
    assert value_of_run(number(), {"metrics.csv": tidy([0.9, 0.99, 1.0])}).high == 100
    # What is compared by a factor has the interval of its logarithm, which does not reach 0.
    labels = value_of_run(number(14, unit="labels", counterpart=ACCURACY), {"metrics.csv": tidy([2, 4, 18])})
    assert 0 < labels.low < 1
    assert labels.high / labels.value == pytest.approx(labels.value / labels.low)
    assert {unit: UNITS[unit].ratio for unit in UNITS} == {unit: TOLERANCES[unit].factor for unit in UNITS}
    counts = {"predicted_as_pose": [20, 30], "test_samples": [100, 60]}
    rows = [tidy(each, metric=metric, concept="overlap") for metric, each in counts.items()]
    results = {"metrics.csv": pd.concat([*rows, tidy([1, 1], metric="test_samples")])}
    assert value_of_run(number(counterpart=TAKEN), results).value == pytest.approx(35)
    rows = pd.concat([tidy([0.9, 0.9]), tidy([0.7, 0.5], source="linemod")])
    found = value_of_run(number(counterpart=replace(ACCURACY, sources=("ycb", "linemod"))), {"metrics.csv": rows})
    assert (found.value, found.n) == (pytest.approx(75), 2)
    assert value_of_run(number(counterpart=replace(ACCURACY, sources=("ycb", "cups"))), {"metrics.csv": rows}) is None


def test_a_deviation_has_the_interval_of_its_chi_square():
    values, deviation = (
        np.array([0.80, 0.82, 0.84, 0.86, 0.88]),
        number(counterpart=replace(ACCURACY, statistic="deviation")),
    )
    found = value_of_run(deviation, {"metrics.csv": tidy(values)})
    assert found.value == pytest.approx(100 * values.std(ddof=1))
    assert chi2.cdf(4 * (found.value / found.high) ** 2, 4) == pytest.approx(0.025)
    assert chi2.cdf(4 * (found.value / found.low) ** 2, 4) == pytest.approx(0.975)
    assert value_of_run(deviation, {"metrics.csv": tidy([0.8])}) is None


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
    error = 1.98422 * np.sqrt(0.3**2 + 0.1**2) / 10
    assert found.high / found.value == pytest.approx(np.exp(error / 4), rel=1e-5)
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


def predictions(folder, right_of_object, seeds=5, sets=(), method="gpca_paper"):
    """Write, of every object, 20 samples of overlap in each seed, a share of them right and the rest called pose.

    Of sets, the first is like this; in the others nothing is right.
    """
    heads = (*PREDICTION_COLUMNS, *(f"score_{concept}" for concept in CONCEPTS), *(("set",) if sets else ()))
    rows = []
    for name_of_set in sets or (None,):
        for name, right in right_of_object.items():
            for i in range(20):
                named = "overlap" if i < 20 * right and name_of_set in (None, *sets[:1]) else "pose"
                scores = (float(named == concept) for concept in CONCEPTS)
                own_set = (name_of_set,) if sets else ()
                about = (len(rows), "test", name, name.split("_")[0], "overlap", named, False, 0)
                rows.append((*about, *scores, *own_set))
    of_explainer = folder / ("learners" if sets else "predictions") / "ycb" / method
    paths = [of_explainer / f"seed{seed}.csv" for seed in range(100, 100 + seeds)]
    for path in paths:
        write(path, heads, rows)
    return paths


def bounds_of(counterpart, files):
    return cluster_draws([counterpart], files)[counterpart].bounds()


def test_objects_that_differ_make_the_interval_wide(tmp_path):
    alike = predictions(tmp_path / "alike", dict.fromkeys("abcdef", 0.75))
    apart = predictions(tmp_path / "apart", dict(zip("abcdef", (1, 1, 1, 0.5, 0.5, 0.5), strict=True)))
    low, high = bounds_of(ACCURACY, alike)
    # No object and no seed is unlike the others, so that six objects in five seeds count.
    assert (low, high) == pytest.approx(wilson_interval(0.75 * 30, 30))
    low, high = bounds_of(ACCURACY, apart)
    assert 0.5 <= low < 0.6
    assert 0.9 < high <= 1.0
    found = value_of_run(number(), {"metrics.csv": tidy([0.75] * 5)}, cluster_draws([ACCURACY], apart))
    # Of the given objects it has Wilson's of 120 samples in each of five seeds, as no seed differs.
    assert (found.low, found.high) == pytest.approx([100 * bound for bound in wilson_interval(450, 600)])
    found = found.over_objects()
    assert (found.low, found.high) == pytest.approx((100 * low, 100 * high))


def test_confusions_are_shares_too_and_views_of_one_instance_are_one_object(tmp_path):
    files = predictions(tmp_path, dict.fromkeys("abc", 0.75))
    assert bounds_of(TAKEN, files) == pytest.approx(wilson_interval(3.75, 15))
    other = replace(TAKEN, concept="noise")  # of which there is no sample
    assert np.isnan(bounds_of(other, files)).all()
    files = predictions(tmp_path, {"cup_1_1": 1.0, "cup_1_2": 0.0})
    assert bounds_of(ACCURACY, files) == pytest.approx(wilson_interval(2.5, 5))


def test_what_is_no_share_of_samples_has_none_and_files_that_are_none_are_refused(tmp_path):
    deviation = replace(ACCURACY, statistic="deviation")
    assert [folder_behind(c) for c in (None, LABELS, deviation, replace(ACCURACY, metrics=("ece",)))] == [None] * 4
    assert folders_behind([ACCURACY, TAKEN, LABELS, None]) == [("predictions", "ycb", "gpca_paper")]
    assert cluster_draws([ACCURACY, LABELS, None], []) == {}
    [path] = predictions(tmp_path, {"a": 1.0}, seeds=1)
    path.write_text("sample,split\n0,test\n")
    with pytest.raises(InputError, match=r"seed100\.csv"):
        cluster_draws([ACCURACY], [path])
    (tmp_path / "metrics.csv").write_text("table,source\n")
    with pytest.raises(InputError, match=r"metrics\.csv"):
        read_results([tmp_path / "metrics.csv"])


def test_differences_are_of_the_same_draws(tmp_path):
    right = dict(zip("abcdef", (1, 1, 0.75, 0.5, 0.25, 0.25), strict=True))
    ours = predictions(tmp_path, right)
    theirs = predictions(tmp_path, {name: share - 0.25 for name, share in right.items()}, method="other")
    other = replace(ACCURACY, methods=("other",))
    drawn = cluster_draws([ACCURACY, other], [*ours, *theirs])
    low, high = drawn[ACCURACY].bounds()
    assert high - low > 0.4  # objects differ
    # All objects have the same difference, so that its interval is that of a share in six objects and five seeds.
    assert drawn[ACCURACY].bounds(minus=drawn[other]) == pytest.approx(wilson_interval(7.5, 30))
