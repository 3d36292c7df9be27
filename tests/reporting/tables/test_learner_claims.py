import pytest

from gpca.reporting.tables.learner_claims import table5_claims

REAL = {"ycb": {"title": "YCB", "stand_in": False}}
LEARNERS = {"gpca": "GPC", "learner_forest": "Forest", "learner_linear_svm": "SVM"}


def answers(table):
    return {row[2][0]: (row[3][0], row[4][0]) for row in table.rows}


def test_claims_are_answered_by_the_paired_intervals(diagnostics):
    table = table5_claims(diagnostics, REAL, LEARNERS)
    # Against the forest: -0.0 ± … includes zero; ρ is larger by 0.39 to 0.41. Against the SVM: 3 points less, always.
    assert answers(table) == {"learner_forest": ("yes", "yes"), "learner_linear_svm": ("no", "no")}
    assert table.cells[1, "accuracy"].mean == pytest.approx(-3)
    assert table.cells[0, "rho"].mean == pytest.approx(0.4)
    assert "| YCB | GPC | SVM | no | no | -3.0 ± 0.0 | 0.000 ± 0.066 |" in table.markdown()


def test_one_seed_answers_nothing(diagnostics):
    table = table5_claims(diagnostics[diagnostics["seed"] == 0], REAL, LEARNERS)
    assert set(answers(table).values()) == {("–", "–")}


def test_a_rival_without_predictions_has_no_row(diagnostics):
    table = table5_claims(diagnostics[diagnostics["method"] != "learner_forest"], REAL, LEARNERS)
    assert list(answers(table)) == ["learner_linear_svm"]
