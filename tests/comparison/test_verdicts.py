"""Verdicts: the rule at its edges, what is taken from a run, and the page."""

import json
import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml

from gpca.attribution.metrics import TIDY_COLUMNS as TIDY
from gpca.code_files import ROOT
from gpca.comparison.published import Counterpart, Number
from gpca.comparison.reasons import NONE_YET, Reason
from gpca.comparison.verdicts import (
    COMPARISON_COLUMNS,
    VERDICTS,
    Reproduced,
    Tolerance,
    compare,
    counts,
    measured_on,
    read_results,
    value_of_run,
    verdict_of,
)
from gpca.errors import InputError
from gpca.model.runtime_file import RUNTIME_COLUMNS as RUNTIME_COLUMNS
from gpca.reporting.tables.comparison import comparison_markdown, summary

NAN = math.nan
POINTS = Tolerance(1, 3)
FACTOR = Tolerance(1.5, 3, factor=True)
SETTINGS = yaml.safe_load((ROOT / "config/config.yaml").read_text())["comparison"]["tolerances"]
TOLERANCES = {unit: Tolerance(**tolerance) for unit, tolerance in SETTINGS.items()}
OBJECTS = {name: {"title": name.upper(), "stand_in": False} for name in ("ycb", "linemod", "real_rgbd", "model")}
ACCURACY = Counterpart("metrics.csv", "attribution", ("ycb",), ("gpca_paper",), ("accuracy",), "all", "mean")
LABELS = Counterpart(
    "active_learning.csv", "active_learning/pretrained", ("ycb",), ("random",), ("labels_to_target",), "overlap", "mean"
)
TIME = Counterpart("runtime.csv", "components", ("model",), ("icp", "features"), ("seconds",), "CPU", "mean")


def number(value=90.0, upper=None, decimals=1, unit="%", counterpart=ACCURACY, row="YCB", note=""):
    return Number("I", row, "GP-CA", value, upper or value, decimals, unit, "", "Table I", counterpart, note)


def tidy(values, source="ycb", method="gpca_paper", metric="accuracy", concept="all", table="attribution"):
    rows = [(table, source, method, metric, concept, seed, value) for seed, value in enumerate(values)]
    return pd.DataFrame(rows, columns=list(TIDY))


def compared(numbers, results, objects=OBJECTS, reasons=(), **more):
    return compare(numbers, results, objects, TOLERANCES, reasons, **more)


# --- the rule ---


@pytest.mark.parametrize(
    ("value", "half_width", "verdict"),
    [
        (90.0, NAN, "reproduced"),
        (91.04, NAN, "reproduced"),  # a tolerance of 1, and half a digit of rounding
        (91.06, NAN, "close"),
        (88.96, 0.0, "reproduced"),
        (92.0, 1.9, "close"),
        (92.0, 2.0, "reproduced"),  # the interval meets the printed value
        (93.04, NAN, "close"),
        (93.06, NAN, "not reproduced"),
        (86.94, 0.1, "not reproduced"),
        (86.0, 4.0, "close"),  # meets it, but so wide an interval says little
        (86.0, 3.9, "not reproduced"),
    ],
)
def test_the_rule_in_percentage_points(value, half_width, verdict):
    found = Reproduced(value, value - half_width, value + half_width, 5)
    assert verdict_of(number(90.0), found, POINTS) == verdict


@pytest.mark.parametrize(
    ("value", "verdict"),
    [(82.96, "reproduced"), (94.5, "reproduced"), (97.0, "close"), (97.1, "not reproduced"), (81, "close")],
)
def test_a_printed_range_and_a_printed_deviation_widen_the_band(value, verdict):
    found = Reproduced(value, NAN, NAN, 1)
    assert verdict_of(number(86.0, upper=92.0), found, POINTS, deviation=2.0) == verdict


@pytest.mark.parametrize(
    ("value", "low", "high", "verdict"),
    [
        (0.67, NAN, NAN, "reproduced"),
        (1.5, NAN, NAN, "reproduced"),
        (1.6, NAN, NAN, "close"),
        (0.35, NAN, NAN, "close"),
        (3.2, NAN, NAN, "not reproduced"),
        (0.004, 0.003, 0.005, "not reproduced"),
        (0.5, -0.2, 1.2, "reproduced"),  # its upper end is within a factor of 3
        (0.3, -0.6, 1.2, "close"),
    ],
)
def test_times_are_compared_by_factor(value, low, high, verdict):
    printed = number(1.0, decimals=2, unit="s", counterpart=TIME)
    assert verdict_of(printed, Reproduced(value, low, high, 5), FACTOR) == verdict


def test_a_lower_bound_is_judged_only_where_it_is_beyond():
    printed = number(14, decimals=0, unit="labels", counterpart=LABELS)
    tolerance = Tolerance(4, 12)
    assert verdict_of(printed, Reproduced(27, NAN, NAN, 5, at_least=True), tolerance) == "not reproduced"
    assert verdict_of(printed, Reproduced(14, NAN, NAN, 5, at_least=True), tolerance) is None


@pytest.mark.parametrize("given", [(3, 1), (-1, 1), (0.9, 2, True)])
def test_tolerances_have_an_order(given):
    with pytest.raises(InputError, match="it has to be"):
        Tolerance(*given)


# --- what stands beside a number ---


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
    assert (row.verdict, row.at_least) == ("not comparable", True)
    assert "lower bound" in row.reason
    rows = pd.concat([labels, tidy([1, 1], metric="reached", **table)])
    assert not value_of_run(printed, {"active_learning.csv": rows}).at_least


def runtime(**seconds):
    rows = [(name, "CPU", "A processor", 1, 100, mean, 0.1 * mean, mean) for name, mean in seconds.items()]
    rows += [(name, "GPU", "A GPU", 1, 100, mean / 10, 0.1 * mean, mean) for name, mean in seconds.items()]
    return pd.DataFrame(rows, columns=list(RUNTIME_COLUMNS))


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
    rows = {"timings.csv": tidy([2.0, 3.0], metric="seconds_per_sample")}
    [row] = compared([number(2, 4, 0, "s", counterpart)], rows, hardware="Some cores").itertuples()
    assert (row.verdict, row.hardware) == ("reproduced", "Some cores")


# --- verdicts and reasons ---


def test_every_verdict_and_its_reason():
    results = {"metrics.csv": pd.concat([tidy([0.9, 0.9]), tidy([0.98, 0.98], method="gpca")])}
    other = replace(ACCURACY, methods=("gpca",))
    numbers = [
        number(row="YCB"),
        number(row="close", counterpart=replace(ACCURACY), value=92.0),
        number(row="far", counterpart=other),
        number(row="none", counterpart=None, note="nobody measured it"),
        number(row="not run", counterpart=replace(ACCURACY, methods=("shap_additive",))),
        number(row="no file", counterpart=TIME, unit="s"),
    ]
    rows = compared(numbers, results, reasons=[Reason("I", "far", "*", "Other data.")])
    assert tuple(rows.columns) == COMPARISON_COLUMNS
    assert list(zip(rows["verdict"], rows["reason"], strict=True)) == [
        ("reproduced", ""),
        ("close", NONE_YET),
        ("not reproduced", "Other data."),
        ("not comparable", "nobody measured it"),
        ("not run", "metrics.csv holds no such value"),
        ("not run", "runtime.csv holds no such value"),
    ]
    assert list(rows["difference"][:3]) == pytest.approx([0, -2, 8])
    assert counts(rows) == dict(zip(VERDICTS, (1, 1, 1, 1, 2), strict=True))


def test_stand_ins_are_shown_but_never_compared():
    stand_ins = OBJECTS | {"ycb": {"title": "YCB", "stand_in": True}}
    numbers = [number(), number(row="LINEMOD", counterpart=replace(ACCURACY, methods=("nothing",)))]
    rows = compared(numbers, {"metrics.csv": tidy([0.9, 0.9])}, stand_ins, [Reason("*", "*", "*", "A reason.")])
    assert set(rows["verdict"]) == {"not comparable"}
    assert set(rows["reason"]) == {"procedural stand-in"}
    assert rows["reproduced"][0] == pytest.approx(90)
    assert set(rows["objects"]) == {"YCB (procedural stand-in)"}
    assert "only real ones are compared" in summary(rows)


def test_a_printed_deviation_belongs_to_the_mean_of_the_same_counterpart():
    deviation = replace(number(3.0, counterpart=replace(ACCURACY, statistic="deviation")), column="Std. Dev.")
    rows = compared([number(94.5), deviation], {"metrics.csv": tidy([0.88, 0.9, 0.92])})
    assert (rows["deviation"][0], rows["verdict"][0]) == (3.0, "close")
    assert math.isnan(rows["deviation"][1])


def test_a_unit_without_tolerance_is_named():
    with pytest.raises(InputError, match=r"comparison\.tolerances: no unit '%'; give its tolerance"):
        compare([number()], {}, OBJECTS, {}, [])


def test_a_results_file_that_is_none_is_refused(tmp_path):
    (tmp_path / "metrics.csv").write_text("table,source\n")
    with pytest.raises(InputError, match=r"metrics\.csv"):
        read_results([tmp_path / "metrics.csv"])


# --- the page ---


def test_the_page_counts_first_and_gives_each_reason_once():
    numbers = [
        number(),
        number(97.0, row="LINEMOD"),
        number(98.0, row="Coffee Cup"),
        replace(number(1.0, 2.0, 0, "s", TIME), table="VII", row="ICP alignment", column="Time"),
    ]
    results = {"metrics.csv": tidy([0.9, 0.9]), "runtime.csv": runtime(icp=0.001, features=0.003)}
    page = comparison_markdown(compared(numbers, results, reasons=[Reason("*", "*", "*", "Other | data.")]), SETTINGS)
    first, second, *_ = [line for line in page.splitlines() if line]
    assert first == "# Published and reproduced"
    assert second == "Of 4 printed numbers: 1 reproduced, 0 close, 3 not reproduced, 0 not comparable, 0 not run."
    assert "| YCB | GP-CA | % | 90.0 | 90.0 (90.0 to 90.0) | 2 | +0.0 | **reproduced** |" in page
    assert "| LINEMOD | GP-CA | % | 97.0 | 90.0 (90.0 to 90.0) | 2 | -7.0 | not reproduced [1] |" in page
    assert (
        "| ICP alignment | Time | s | 1 to 2 | 0.004 (0.0039 to 0.0041) | 100 | × 0.004 | not reproduced [1] |" in page
    )
    assert page.count("1. Other | data.") == 2
    assert "|  | reproduced | close | not reproduced | not comparable | not run |\n" in page
    assert "| Table I: Single-concept attribution | 1 |  | 2 |  |  |\n" in page
    assert "| All | 1 | 0 | 3 | 0 | 0 |\n" in page
    assert "## Table VII: Runtime" in page
    assert "Objects here: MODEL. Hardware here: A processor." in page
    assert "Intel i7-12700K and NVIDIA RTX 3090" in page
