"""The file of printed numbers, and the reasons: what they hold, and what is refused."""

import csv

import pytest
import yaml

from gpca.active_learning.acquisition import STRATEGIES
from gpca.classifier.kernel_metrics import setting_name
from gpca.code_files import ROOT
from gpca.comparison.published import PUBLISHED_COLUMNS, TABLES, TEXT, UNITS, printed_seconds, read_published
from gpca.comparison.reasons import NONE_YET, Reason, read_reasons, reason_of
from gpca.errors import InputError
from gpca.model.runtime_file import COMPONENTS
from gpca.reporting.tables.kernel_grid import PRINTED

NUMBERS = read_published()
CONFIG = yaml.safe_load((ROOT / "config/config.yaml").read_text())
LINE = {
    "table": "I", "row": "YCB", "column": "SHAP", "value": "31.4", "decimals": "1", "unit": "%", "place": "Table I",
    "in_file": "metrics.csv", "in_table": "attribution", "source": "ycb", "method": "shap_additive",
    "metric": "accuracy", "concept": "all", "statistic": "mean",
}  # fmt: skip
NO_COUNTERPART = dict.fromkeys(("in_file", "in_table", "source", "method", "metric", "concept", "statistic"), "")


def written(path, *lines, columns=PUBLISHED_COLUMNS):
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.DictWriter(file, columns, restval="", lineterminator="\n")
        rows.writeheader()
        rows.writerows(lines)
    return path


# --- what is printed ---


def test_every_cell_of_the_papers_tables_is_there_once():
    cells = {(name, row, column) for name, table in TABLES.items() for row in table.rows for column in table.columns}
    assert {number.key for number in NUMBERS if number.table != TEXT} == cells


@pytest.mark.parametrize(
    ("key", "text"),
    [
        (("I", "YCB", "GP-CA"), "99.6"),
        (("III", "LINEMOD", "#Labels Random"), "350 to 550"),
        (("V", "Linear SVM", "ρ"), "-0.011"),
        (("VI", "PointNet, AE", "Std. Dev."), "12.53"),
        (("VII", "GPC retraining (optional)", "Time"), "10 to 30"),
        ((TEXT, "Analytical features, YCB", "Accuracy"), "66"),
        ((TEXT, "Random, depth frames", "Labels to 70 %"), "101"),
        ((TEXT, "DGCNN, depth frames, overlap", "Taken for pose"), "23.0"),
        ((TEXT, "ICP and DGCNN", "Time"), "4.2"),
    ],
)
def test_numbers_are_as_printed(key, text):
    [number] = [number for number in NUMBERS if number.key == key]
    assert number.text() == text


def test_half_of_the_last_digit():
    rounding = {number.key: number.rounding for number in NUMBERS}
    assert rounding["V", "GPC", "AUC"] == pytest.approx(0.00005)
    assert rounding["I", "YCB", "SA"] == pytest.approx(0.05)
    assert rounding["III", "YCB", "#Labels BALD"] == 0.5
    assert rounding["III", "YCB", "Epochs"] == 5


def test_counterparts_name_what_the_config_makes():
    known = {
        "metrics.csv": set(CONFIG["explainers"]),
        "timings.csv": set(CONFIG["explainers"]),
        "active_learning.csv": set(STRATEGIES) & set(CONFIG["active_learning"]["strategies"]),
        "diagnostics.csv": set(CONFIG["learners"]),
        "runtime.csv": set(COMPONENTS),
        "kernels.csv": {setting_name(*setting) for setting in PRINTED},
        "real_world.csv": {
            f"{backbone}-{reduction}"
            for backbone in CONFIG["real_world"]["backbones"]
            for reduction in CONFIG["real_world"]["reductions"]
        }
        | {"bald_kmeans", "random"},
    }
    named = {(n.counterpart.file, method) for n in NUMBERS if n.counterpart for method in n.counterpart.methods}
    assert [(file, method) for file, method in named if method not in known[file]] == []
    assert {method for file, method in named if file == "kernels.csv"} == known["kernels.csv"]


def test_every_unit_has_a_tolerance():
    assert set(CONFIG["comparison"]["tolerances"]) == set(UNITS)


def test_times_come_in_seconds():
    seconds = printed_seconds(NUMBERS)
    assert set(seconds) == {"icp", "features", "sampling", "scores", "bald", "retraining"}
    assert seconds["sampling"].value == pytest.approx(0.010)
    assert (seconds["retraining"].value, seconds["retraining"].upper) == (10, 30)
    assert (seconds["features"].device, seconds["icp"].device) == ("GPU", "CPU")


# --- what is refused ---


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"table": "VIII"}, "line 2: unknown table 'VIII'; expected one of I, II, III, IV, V, VI, VII, text"),
        ({"row": "Tea Cup"}, "line 2: unknown row 'Tea Cup'; expected one of Coffee Cup, LINEMOD, YCB"),
        ({"column": "LIME"}, "line 2: unknown column 'LIME'; expected one of SHAP, SA, GP-CA"),
        ({"unit": "permille"}, "line 2: unknown unit 'permille'; expected one of %, labels, "),
        ({"value": "many"}, "line 2: 'value' is 'many', not a finite number; give one"),
        ({"value": "nan"}, "line 2: 'value' is 'nan', not a finite number; give one"),
        ({"value": ""}, "line 2: 'value' is '', not a finite number; give one"),
        ({"upper": "inf"}, "line 2: 'upper' is 'inf', not a finite number; give one"),
        ({"upper": "31.3"}, "line 2: 'upper' 31.3 is below 'value' 31.4; swap them"),
        ({"value": "31.45"}, "line 2: has a value with more than 1 decimals"),
        ({"decimals": "-1"}, "line 2: has a value with more than -1 decimals"),
        ({"decimals": "1.0"}, "line 2: 'decimals' is '1.0'; give a whole number"),
        ({"decimals": ""}, "line 2: 'decimals' is ''; give a whole number"),
        ({"paper_n": "few"}, "line 2: 'paper_n' is 'few'; give a whole number"),
        ({"paper_n": "-5"}, "line 2: 'paper_n' is '-5'; give a whole number"),
        ({"paper_n": "20"}, "line 2: no share of 20 samples rounds to 31.4 %; correct 'paper_n'"),
        ({"same_as": "I / YCB / SHAP"}, "line 2: 'same_as' I / YCB / SHAP is not a number above; name one of this"),
        ({"place": " "}, "line 2: 'place' is empty; fill it in"),
        ({"table": TEXT, "row": ""}, "line 2: 'row' is empty; fill it in"),
        ({"in_file": "metric.csv"}, "line 2: unknown in_file 'metric.csv'; expected one of metrics.csv, "),
        ({"statistic": "median"}, "line 2: unknown statistic 'median'; expected one of mean, deviation"),
        ({"metric": "a/b/c"}, "line 2: 'metric' is 'a/b/c'; give one metric, or one divided by another"),
        ({"metric": "a/"}, "line 2: 'metric' is 'a/'; give one metric, or one divided by another"),
        ({"concept": ""}, "line 2: names a counterpart, but 'concept' is empty"),
        (NO_COUNTERPART, "line 2: has neither a counterpart nor a note that explains why"),
    ],
)
def test_a_bad_line_is_named(tmp_path, changes, message):
    path = written(tmp_path / "published.csv", LINE | changes)
    with pytest.raises(InputError) as fault:
        read_published(path)
    assert message in str(fault.value)
    assert str(fault.value).startswith(f"{path}, line 2: ")
    assert "\n" not in str(fault.value)


def test_a_cell_twice_names_both_lines(tmp_path):
    path = written(tmp_path / "published.csv", LINE, LINE | {"column": "SA"}, LINE | {"value": "30.0"})
    with pytest.raises(InputError, match="line 4: repeats I / YCB / SHAP; it is on line 2"):
        read_published(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "no such file"),
        (b"", "line 1: has other columns; they must be table,row,column,value,"),
        (b"table,row\nI,YCB\n", "line 1: has other columns"),
        (",".join(PUBLISHED_COLUMNS).encode() + b"\n", "has no numbers"),
        (",".join(PUBLISHED_COLUMNS).encode() + b"\nI,YCB,SHAP\n", "line 2: has 3 fields for 19 columns"),
        (",".join(PUBLISHED_COLUMNS).encode() + b'\nI,"YCB\n', "is not a readable CSV file"),
        (b"\xff\xfe\x00", "is not a readable CSV file"),
    ],
)
def test_a_file_that_is_none_is_refused(tmp_path, content, message):
    path = tmp_path / "published.csv"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=message):
        read_published(path)


def test_several_sources_methods_and_metrics_are_read(tmp_path):
    changes = {"source": "ycb  linemod", "method": "icp+features", "metric": "a/b", "upper": "40.0", "device": "CPU"}
    [number] = read_published(written(tmp_path / "published.csv", LINE | changes))
    found = number.counterpart
    assert (found.sources, found.methods, found.metrics) == (("ycb", "linemod"), ("icp", "features"), ("a", "b"))
    assert number.text() == "31.4 to 40.0"


# --- reasons ---

REASON = {"table": "I", "row": "*", "column": "SHAP", "reason": "All is called pose."}


def test_the_first_reason_that_fits_counts():
    [number] = [number for number in NUMBERS if number.key == ("I", "YCB", "SHAP")]
    reasons = [Reason("II", "*", "*", "a"), Reason("I", "Y*", "SHAP", "b"), Reason("*", "*", "*", "c")]
    assert reason_of(number, reasons) == "b"
    assert reason_of(number, reasons[2:]) == "c"
    assert reason_of(number, reasons[:1]) == NONE_YET


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"table": "VIII"}, "line 3: VIII / * / SHAP is not a printed number; use names from published.csv, or *"),
        ({"row": "Tea*"}, "line 3: I / Tea* / SHAP is not a printed number"),
        ({"column": "shap"}, "line 3: I / * / shap is not a printed number"),
        ({"reason": ""}, "line 3: 'reason' is empty; say what was found, or remove the line"),
    ],
)
def test_a_reason_of_nothing_is_refused(tmp_path, changes, message):
    path = written(tmp_path / "reasons.csv", REASON, REASON | changes, columns=tuple(REASON))
    with pytest.raises(InputError) as fault:
        read_reasons(NUMBERS, path)
    assert message in str(fault.value)


def test_a_reason_with_a_comma_out_of_quotes_is_refused(tmp_path):
    path = tmp_path / "reasons.csv"
    path.write_text("table,row,column,reason\nI,*,SHAP,first, second\n")
    with pytest.raises(InputError, match="line 2: has 5 fields for 4 columns; quote text that contains a comma"):
        read_reasons(NUMBERS, path)


def test_the_shipped_reasons_are_of_printed_numbers():
    assert len(read_reasons(NUMBERS)) > 20
