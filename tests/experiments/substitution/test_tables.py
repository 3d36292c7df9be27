"""Table XIV."""

import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.evaluation.measures import COLUMNS
from gpca.experiments.substitution.tables import table14_estimator_explanations, table14_method_matrix

SOURCES = {"ycb": {"title": "YCB", "stand_in": False}, "cups": {"title": "Cups", "stand_in": True}}
EXPLAINERS = {"gpca": "GP-CA", "shap": "SHAP"}
ESTIMATORS, METHODS = {"monte_carlo": "Monte-Carlo", "censi": "Censi"}, {"icp": "ICP", "gicp": "GICP"}


@pytest.fixture
def intervals():
    rows = []

    def add(explainer, beneath, metric, concept, value, samples=80):
        own = (explainer, "pooled", beneath, metric, concept, 2, 6, samples)
        rows.append((*own, value, 0.8 * value, min(1.0, 1.1 * value)))

    for estimator, accuracy in {"monte_carlo": 0.25, "censi": 0.5}.items():
        add("shap", estimator, "accuracy", "all", accuracy)
        add("shap", estimator, "agreement", "all", accuracy)
        for concept in ("noise", "pose", "overlap"):
            add("shap", estimator, "accuracy", concept, accuracy, 20 + 5 * (concept == "pose"))
    for learnt_from in METHODS:
        for asked_of in (*METHODS, "another"):
            add("gpca", asked_of, "accuracy", learnt_from, 0.9 if asked_of == learnt_from else 0.6)
            add("gpca", asked_of, "failed", learnt_from, 0.1 * (asked_of == "gicp"))
    return pd.DataFrame(rows, columns=[*COLUMNS])


def test_estimators_are_rows_of_each_explainer_that_reads_one(intervals):
    table = table14_estimator_explanations(intervals, SOURCES, EXPLAINERS, ESTIMATORS)
    assert [tuple(key for key, _ in labels) for labels in table.rows] == [("shap", "monte_carlo"), ("shap", "censi")]
    assert table.cells[0, "pose"].mean == pytest.approx(25)
    assert table.cells[0, "pose"].bounds == pytest.approx((20, 27.5))
    assert table.cells[1, "agreement"].mean == pytest.approx(50)
    assert (0, "agreement") not in table.cells  # with itself
    assert table.best() == {(1, "all")}
    text = table.markdown()
    assert "Shares of 80 test samples of all datasets together, 20 to 25 of each concept." in text
    assert "Over 2 seeds; in brackets: the 95 % interval of a bootstrap over families of objects and seeds" in text
    assert "partly on procedural stand-ins" in table.caption


def test_the_matrix_has_a_row_for_each_method_that_was_learnt_from(intervals):
    table = table14_method_matrix(intervals, SOURCES, EXPLAINERS, METHODS, {"Small": "small_gicp"})
    assert [tuple(key for key, _ in labels) for labels in table.rows] == [("gpca", "icp"), ("gpca", "gicp")]
    assert table.cells[0, "icp"].mean == pytest.approx(90) and table.cells[0, "another"].mean == pytest.approx(60)
    text = table.markdown()
    assert "ICP 0.0 %, GICP 10.0 %" in text
    assert "| GP-CA | ICP | **90.0 (72.0 to 99.0)** | 60.0 (48.0 to 66.0) | 60.0 (48.0 to 66.0) |" in text
    assert "Left out, as the package is not installed: Small needs the package small_gicp" in text


def test_metrics_of_nothing_that_is_shown_are_refused(intervals):
    with pytest.raises(InputError, match="has nothing to show"):
        table14_method_matrix(intervals, SOURCES, {"head": "Head"}, METHODS, {})
    with pytest.raises(InputError, match="has nothing to show"):
        table14_estimator_explanations(intervals, SOURCES, {"head": "Head"}, ESTIMATORS)
