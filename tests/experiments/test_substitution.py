"""Explanations with other methods and estimators, from files of predictions to Table XIV."""

import pandas as pd
import pytest

from gpca.evaluation.measures import COLUMNS
from gpca.experiments import registration_methods
from gpca.experiments.substitution import collect, table14_estimator_explanations, table14_method_matrix
from gpca.reporting.tables.cells import rows_where
from tests.experiments.runs import run_with

CONCEPTS = ("noise", "pose", "overlap")
ESTIMATORS, METHODS = ("monte_carlo", "censi"), ("point_to_point", "gicp")
EXCHANGE = {"sources": ["ycb", "cups"], "explainers": dict.fromkeys(("gpca", "shap_additive"))}
RUN = run_with(exchange=EXCHANGE | {"estimators": ESTIMATORS, "methods": METHODS})


def prediction(exchanged, learnt_from, asked_of, explainer, sample, true, named, failure=""):
    labels = {"exchanged": exchanged, "learnt_from": learnt_from, "asked_of": asked_of, "explainer": explainer}
    answer = {"sample": sample, "split": "test", "object": "mug", "cluster": "mug"}
    answer |= {"concept_true": true, "concept_predicted": named}
    scores = {f"score_{concept}": 0.0 for concept in CONCEPTS}
    return labels | answer | {"abstained": named == "", "icp_calls": 0, **scores, "failure": failure}


@pytest.fixture
def path(tmp_path):
    rows = []
    for estimator, named in {"monte_carlo": ("pose", "pose"), "censi": ("noise", ""), "bonnabel": ("", "")}.items():
        refused = "refused" if estimator == "bonnabel" else ""
        for sample, true in enumerate(("noise", "pose")):
            rows.append(prediction("estimator", estimator, estimator, "shap", sample, true, named[sample], refused))
    for learnt_from in ("icp", "gicp"):
        for asked_of in ("icp", "gicp"):
            for sample, true in enumerate(("noise", "pose")):
                right = learnt_from == asked_of or sample == 0
                failed = "lost" if asked_of == "gicp" and sample == 1 else ""
                named = true if right else "overlap"
                rows.append(prediction("method", learnt_from, asked_of, "gpca", sample, true, named, failed))
    path = tmp_path / "exchange" / "ycb" / "seed3.csv"
    path.parent.mkdir(parents=True)
    pd.DataFrame(rows).to_csv(path, index=False)
    return path


def by_seed(path, **wanted):
    rows, _ = collect(RUN, [path])
    assert set(rows["seed"]) == {3} and set(rows["source"]) == {"ycb"}
    return rows_where(rows, **wanted).set_index(["method", "concept", "metric"])["value"].to_dict()


def test_estimators_are_judged_beside_monte_carlo_and_methods_by_that_of_the_training_pairs(path):
    values = by_seed(path, table="shap")
    expected = {
        ("monte_carlo", "all", "accuracy"): 0.5,
        ("monte_carlo", "pose", "accuracy"): 1,
        ("monte_carlo", "noise", "accuracy"): 0,
        ("monte_carlo", "all", "agreement"): 1,
        ("censi", "all", "agreement"): 0,
        ("censi", "all", "abstained"): 0.5,
        ("censi", "all", "no_estimate"): 0,
        ("bonnabel", "all", "accuracy"): 0,
        ("bonnabel", "all", "no_estimate"): 1,
        ("bonnabel", "all", "abstained"): 0,
        ("censi", "noise", "test_samples"): 1,
    }
    assert {key: values[key] for key in expected} == expected
    rows = pd.read_csv(path, keep_default_na=False)
    rows[rows["asked_of"] != "monte_carlo"].to_csv(path, index=False)
    assert "agreement" not in {metric for _, _, metric in by_seed(path, table="shap")}
    values = by_seed(path, table="gpca")
    assert values["icp", "icp", "accuracy"] == 1 and values["gicp", "icp", "accuracy"] == 0.5
    assert values["another", "gicp", "accuracy"] == 0.5
    assert values["gicp", "icp", "failed"] == 0.5


def test_intervals_are_of_the_same_shares_over_families_of_all_sources(path, tmp_path):
    other = tmp_path / "exchange/cups/seed3.csv"
    other.parent.mkdir()
    other.write_text(path.read_text())
    keys = ["table", "method", "metric", "concept"]
    single, _ = collect(RUN, [path])
    shares = single[single["metric"] != "test_samples"].set_index(keys)["value"]
    intervals = collect(RUN, [path, other])[1].set_index(keys)
    assert set(intervals.index) == set(shares.index)
    assert (intervals["value"] == shares[intervals.index]).all()
    row = intervals.loc["gpca", "another", "accuracy", "gicp"]
    assert (row["source"], row["seeds"], row["clusters"], row["samples"]) == ("pooled", 1, 2, 4)
    assert (intervals["low"] < intervals["high"]).all()


@pytest.fixture
def intervals():
    rows = []

    def add(explainer, method, metric, concept, value, samples=80):
        keys = (explainer, "pooled", method, metric, concept, 2, 6, samples)
        rows.append((*keys, value, 0.8 * value, min(1.0, 1.1 * value)))

    for estimator, accuracy in zip(ESTIMATORS, (0.25, 0.5), strict=True):
        add("shap_additive", estimator, "accuracy", "all", accuracy)
        add("shap_additive", estimator, "agreement", "all", accuracy)
        for concept in CONCEPTS:
            add("shap_additive", estimator, "accuracy", concept, accuracy, 20 + 5 * (concept == "pose"))
    for learnt_from in METHODS:
        for asked_of in (*METHODS, "another"):
            add("gpca", asked_of, "accuracy", learnt_from, 0.9 if asked_of == learnt_from else 0.6)
            add("gpca", asked_of, "failed", learnt_from, 0.1 * (asked_of == "gicp"))
    return pd.DataFrame(rows, columns=[*COLUMNS])


def keys_of(table):
    return [tuple(key for key, _ in labels) for labels in table.rows]


def test_estimators_are_rows_of_each_explainer_that_reads_one(intervals):
    table = table14_estimator_explanations(RUN, intervals)
    assert keys_of(table) == [("shap_additive", name) for name in ESTIMATORS]
    assert table.cells[0, "pose"].mean == pytest.approx(25)
    assert table.cells[0, "pose"].bounds == pytest.approx((20, 27.5))
    assert table.cells[1, "agreement"].mean == pytest.approx(50)
    assert (0, "agreement") not in table.cells  # with itself
    assert table.best() == {(1, "all")}
    text = table.markdown()
    assert "Shares of 80 test samples of all datasets together, 20 to 25 of each concept." in text
    assert "Over 2 seeds; in brackets: the 95 % interval of a bootstrap over families of objects and seeds" in text
    assert "partly on procedural stand-ins" in table.caption


def test_the_matrix_has_a_row_for_each_method_of_the_training_pairs(intervals, monkeypatch):
    monkeypatch.setattr(registration_methods.registry, "left_out", lambda names: {"gicp_small": "small_gicp"})
    monkeypatch.setattr("gpca.experiments.substitution.installed", list)
    table = table14_method_matrix(RUN, intervals)
    assert keys_of(table) == [("gpca", name) for name in METHODS]
    assert table.cells[0, "point_to_point"].mean == pytest.approx(90)
    assert table.cells[0, "another"].mean == pytest.approx(60)
    text, title = table.markdown(), table.rows[0][0][1]
    assert "ICP, point-to-point 0.0 %, GICP 10.0 %" in text
    cells = "**90.0 (72.0 to 99.0)** | 60.0 (48.0 to 66.0) | 60.0 (48.0 to 66.0) |"
    assert f"| {title} | ICP, point-to-point | {cells}" in text
    assert "Left out, as the package is not installed: GICP (small_gicp) needs the package small_gicp" in text
