"""Table XIV."""

import pytest

from gpca.attribution.metrics import tidy
from gpca.errors import InputError
from gpca.experiments.substitution.tables import table14_estimator_explanations, table14_method_matrix

SOURCES = {"ycb": {"title": "YCB", "stand_in": False}, "cups": {"title": "Cups", "stand_in": True}}
EXPLAINERS = {"gpca": "GP-CA", "shap": "SHAP"}
ESTIMATORS, METHODS = {"monte_carlo": "Monte-Carlo", "censi": "Censi"}, {"icp": "ICP", "gicp": "GICP"}


@pytest.fixture
def metrics():
    records = []
    for source, samples in {"ycb": 30, "cups": 10}.items():
        of = lambda *row, source=source: [(row[0], source, *row[1:4], seed, row[4]) for seed in range(2)]  # noqa: E731
        for estimator, accuracy in {"monte_carlo": 0.25, "censi": 0.5}.items():
            for concept in ("all", "noise", "pose", "overlap"):
                value = 0.75 if source == "cups" else accuracy
                records += of("shap", estimator, "accuracy", concept, value)
                records += of("shap", estimator, "test_samples", concept, samples)
            records += of("shap", estimator, "agreement", "all", accuracy)
        for learnt_from in METHODS:
            for asked_of in (*METHODS, "another"):
                records += of("gpca", asked_of, "accuracy", learnt_from, 0.9 if asked_of == learnt_from else 0.6)
                records += of("gpca", asked_of, "failed", learnt_from, 0.1 * (asked_of == "gicp"))
                records += of("gpca", asked_of, "test_samples", learnt_from, samples)
    return tidy(records, "exchange")


def test_estimators_are_rows_of_each_explainer_that_reads_one(metrics):
    table = table14_estimator_explanations(metrics, SOURCES, EXPLAINERS, ESTIMATORS)
    assert [tuple(key for key, _ in labels) for labels in table.rows] == [("shap", "monte_carlo"), ("shap", "censi")]
    assert table.cells[0, "pose"].mean == pytest.approx(25 + 50 * 10 / 40)
    assert table.cells[1, "agreement"].mean == pytest.approx(50)
    assert (0, "agreement") not in table.cells  # with itself
    assert table.best() == {(1, "all")}
    assert "Shares of 80 test samples, of 2 seeds and all datasets together, 80 of each concept." in table.markdown()
    assert "partly on procedural stand-ins" in table.caption


def test_the_matrix_has_a_row_for_each_method_that_was_learnt_from(metrics):
    table = table14_method_matrix(metrics, SOURCES, EXPLAINERS, METHODS, {"Small": "small_gicp"})
    assert [tuple(key for key, _ in labels) for labels in table.rows] == [("gpca", "icp"), ("gpca", "gicp")]
    assert table.cells[0, "icp"].mean == pytest.approx(90) and table.cells[0, "another"].mean == pytest.approx(60)
    text = table.markdown()
    assert "ICP 0.0 %, GICP 10.0 %" in text
    assert "| GP-CA | ICP | **90.0 (81.5 to 94.8)** | 60.0 (49.0 to 70.0) | 60.0 |" in text
    assert "Left out, as the package is not installed: Small needs the package small_gicp" in text


def test_metrics_of_nothing_that_is_shown_are_refused(metrics):
    with pytest.raises(InputError, match="has nothing to show"):
        table14_method_matrix(metrics, SOURCES, {"head": "Head"}, METHODS, {})
    with pytest.raises(InputError, match="has nothing to show"):
        table14_estimator_explanations(metrics, SOURCES, {"head": "Head"}, ESTIMATORS)
