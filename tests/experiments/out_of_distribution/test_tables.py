import pytest

from gpca.errors import InputError
from gpca.experiments.out_of_distribution.tables import (
    repeats_note,
    samples_of_seed,
    table5_compact,
    table5_learners,
    table5_shift,
)
from gpca.reporting.tables.builder import TableBuilder
from gpca.reporting.tables.cells import plain_cell

REAL = {"ycb": {"title": "YCB", "stand_in": False}, "linemod": {"title": "LINEMOD", "stand_in": False}}
STAND_INS = {name: entry | {"stand_in": True} for name, entry in REAL.items()}
LEARNERS = {"gpca": "GPC", "learner_forest": "Forest", "learner_linear_svm": "SVM"}
OVER_FAMILIES = "in brackets: the 95 % interval of a bootstrap over families of objects and seeds"


def test_table5_shows_accuracy_and_diagnostics_and_marks_the_best(diagnostics):
    markdown = table5_learners(diagnostics, REAL, LEARNERS).markdown()
    assert "| Dataset | Learner | Accuracy (%) | ρ | AURC | E-AURC | AUGRC | ECE (share) |" in markdown
    row = "| YCB | GPC | 96.0 (86.4 to 97.0) | **0.520 (0.468 to 0.525)** | **0.0040 (0.0036 to 0.0040)** |"
    assert row in markdown
    assert "**99.0 (89.1 to 100.0)**" in markdown
    assert "**0.020 (0.018 to 0.020)**" in markdown
    assert "LINEMOD" not in markdown
    assert f"Over 3 seeds; {OVER_FAMILIES}" in markdown


def test_table5_has_the_papers_form_too(diagnostics):
    markdown = table5_compact(diagnostics, REAL, LEARNERS).markdown()
    assert "| Learner | YCB (%) | LINEMOD (%) | ρ | AURC | ECE (share) |" in markdown
    assert f"Over 3 seeds, 40 test samples each; {OVER_FAMILIES}" in markdown
    assert "the paper's AUC" in markdown
    assert "| GPC | 96.0 (86.4 to 97.0) | – | **0.520 (0.468 to 0.525)** |" in markdown


def test_table5_shift_has_every_kind_of_shift(diagnostics):
    table = table5_shift(diagnostics, REAL, LEARNERS)
    assert [key for key in table.columns if key.startswith("rho")] == ["rho_severity", "rho_source", "rho_objects"]
    titles = [column.title for column in table.columns.values()]
    assert len(set(titles)) == len(titles)
    assert table.cells[0, "rho_objects"].test_samples == 3 * (40 + 40)
    assert table.cells[0, "accuracy_objects"].test_samples == 3 * 40


@pytest.mark.parametrize("make", [table5_learners, table5_compact, table5_shift])
def test_stand_ins_are_said_and_nothing_to_show_is_a_fault(diagnostics, make):
    table = make(diagnostics, STAND_INS, LEARNERS)
    assert "on procedural stand-ins" in table.caption
    assert table.latex().count("{") == table.latex().count("}")
    assert "nan" not in table.markdown().lower()
    with pytest.raises(InputError, match="has nothing to show"):
        make(diagnostics[:0], REAL, LEARNERS)


def test_the_footnote_names_the_samples_of_every_set_that_there_is(diagnostics):
    table = TableBuilder("table5", {"source": "Dataset"})
    table.add_row([("ycb", "YCB")], {"a": plain_cell(1.0, 3, 120)})
    assert samples_of_seed(diagnostics, "ycb", "objects") == 40
    without = diagnostics[diagnostics["table"] != "learners/severity"]
    note = repeats_note(table, without)
    assert "40 in distribution, 40 source, 40 seen objects, 40 objects" in note and "severity" not in note
