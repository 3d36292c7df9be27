"""The files of printed numbers and of reasons: what they hold."""

from itertools import product

import pytest
import yaml

from gpca.active_learning.acquisition import STRATEGIES
from gpca.comparison import published
from gpca.evaluation.runtime_file import COMPONENTS
from gpca.experiments.kernel_grid import PRINTED, setting_name
from gpca.process.code_files import ROOT

NUMBERS = published.read_published()
CONFIG = yaml.safe_load((ROOT / "config/config.yaml").read_text())
FILES = {
    *("metrics.csv", "timings.csv", "active_learning.csv", "kernels.csv", "diagnostics.csv", "real_world.csv"),
    *("runtime.csv", "recovery.csv"),
}


def test_every_cell_is_there_once_with_its_rounding_and_every_unit_has_a_tolerance():
    for table, size in {"I": 9, "II": 9, "III": 12, "IV": 10, "V": 18, "VI": 32, "VII": 6}.items():
        rows, columns = ({n.key[part] for n in NUMBERS if n.table == table} for part in (1, 2))
        assert {number.key for number in NUMBERS if number.table == table} == set(product([table], rows, columns))
        assert len(rows) * len(columns) == size
    assert set(CONFIG["comparison"]["tolerances"]) == set(published.UNITS)
    rounding = {number.key: number.rounding for number in NUMBERS}
    assert rounding["V", "GPC", "AUC"] == pytest.approx(0.00005)
    assert rounding["I", "YCB", "SA"] == pytest.approx(0.05)
    assert rounding["III", "YCB", "#Labels BALD"] == 0.5
    assert rounding["III", "YCB", "Epochs"] == 5


def test_numbers_are_as_printed_and_times_in_seconds():
    seconds = published.printed_seconds(NUMBERS)
    assert set(seconds) == {"icp", "features", "sampling", "scores", "bald", "retraining"}
    assert seconds["sampling"].value == pytest.approx(0.010)
    assert (seconds["retraining"].value, seconds["retraining"].upper) == (10, 30)
    assert (seconds["features"].device, seconds["icp"].device) == ("GPU", "CPU")
    texts = {number.key: number.text() for number in NUMBERS}
    printed = {
        ("I", "YCB", "GP-CA"): "99.6",
        ("III", "LINEMOD", "#Labels Random"): "350 to 550",
        ("V", "Linear SVM", "ρ"): "-0.011",
        ("VI", "PointNet, AE", "Std. Dev."): "12.53",
        ("VII", "GPC retraining (optional)", "Time"): "10 to 30",
        (published.TEXT, "Analytical features, YCB", "Accuracy"): "66",
        (published.TEXT, "Random, depth frames", "Labels to 70 %"): "101",
        (published.TEXT, "DGCNN, depth frames, overlap", "Taken for pose"): "23.0",
        (published.TEXT, "ICP and DGCNN", "Time"): "4.2",
    }
    assert {key: texts[key] for key in printed} == printed


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


def test_table_vs_gpc_is_the_matern_row_whose_values_it_prints():
    of_key = {number.key: number for number in NUMBERS}
    learner, grid = CONFIG["learners"]["gpca_matern"], CONFIG["kernel_grid"]
    row = setting_name(learner["kernel"], learner["learning_rate"], learner["iterations"])
    for column, source in (("LM", "LINEMOD"), ("YCB", "YCB")):
        number = of_key["V", "GPC", column]
        first = of_key[number.same_as]
        assert (first.table, first.column, first.value) == ("IV", source, number.value)
        assert first.counterpart.methods == (row,)
    assert {number.counterpart.methods for key, number in of_key.items() if key[:2] == ("V", "GPC")} == {
        ("gpca_matern",)
    }
    assert [learner[name] for name in ("inducing", "draws")] == [grid[name] for name in ("inducing", "draws")]


def test_the_file_keeps_the_rules_of_its_columns():
    assert [line for line in published.read_lines(published.PUBLISHED) if None in (*line, *line.values())] == []
    keys = [number.key for number in NUMBERS]
    assert len(set(keys)) == len(keys)
    for at, number in enumerate(NUMBERS):
        assert number.table in published.TITLES, number
        assert number.unit in published.UNITS, number
        assert all((*number.key, number.place)), number
        assert number.upper >= number.value, number
        assert all(round(bound, number.decimals) == bound for bound in (number.value, number.upper)), number
        assert not number.same_as or number.same_as in keys[:at], number
        counterpart = number.counterpart
        if counterpart is None:
            assert number.note, number
            continue
        assert counterpart.file in FILES, number
        assert counterpart.statistic in ("mean", "deviation"), number
        assert all((counterpart.table, counterpart.sources, *counterpart.methods, counterpart.concept)), number
        assert len(counterpart.metrics) <= 2, number
        assert all(counterpart.metrics), number
        if number.paper_n and number.unit == "%" and counterpart.statistic == "mean":
            nearest = 100 * round(number.value / 100 * number.paper_n) / number.paper_n
            assert abs(nearest - number.value) <= number.rounding + 1e-9, number


def test_several_sources_methods_and_metrics_are_read(tmp_path, monkeypatch):
    line = {
        "table": "I", "row": "YCB", "column": "SHAP", "value": "31.4", "upper": "40.0", "decimals": "1", "unit": "%",
        "device": "CPU", "place": "Table I", "in_file": "metrics.csv", "in_table": "attribution",
        "source": "ycb  linemod", "method": "icp+features", "metric": "a/b", "concept": "all", "statistic": "mean",
        "paper_n": "", "same_as": "", "note": "",
    }  # fmt: skip
    (tmp_path / "published.csv").write_text(",".join(line) + "\n" + ",".join(line.values()) + "\n")
    monkeypatch.setattr(published, "PUBLISHED", tmp_path / "published.csv")
    [number] = published.read_published()
    means = number.counterpart
    assert (means.sources, means.methods, means.metrics) == (("ycb", "linemod"), ("icp", "features"), ("a", "b"))
    assert number.text() == "31.4 to 40.0"


def test_the_first_reason_that_fits_counts_and_all_are_of_printed_numbers():
    [number] = [number for number in NUMBERS if number.key == ("I", "YCB", "SHAP")]
    reasons = [
        published.Reason("II", "*", "*", "a"),
        published.Reason("I", "Y*", "SHAP", "b"),
        published.Reason("*", "*", "*", "c"),
    ]
    assert published.reason_of(number, reasons) == "b"
    assert published.reason_of(number, reasons[2:]) == "c"
    assert published.reason_of(number, reasons[:1]) == published.NONE_YET
    reasons = published.read_reasons()
    assert len(reasons) > 20
    for reason in reasons:
        assert reason.text, reason
        assert any(published.reason_of(number, [reason]) == reason.text for number in NUMBERS), reason
