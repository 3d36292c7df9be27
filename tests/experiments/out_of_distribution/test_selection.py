import pytest

from gpca.experiments.out_of_distribution.selection import (
    RHO,
    only,
    printed_scale,
    repeats_note,
    samples_of_seed,
    values_by_seed,
)
from gpca.reporting.tables.builder import TableBuilder
from gpca.reporting.tables.cells import plain_cell


def test_only_the_metrics_asked_for_and_the_numbers_of_samples_stay(diagnostics):
    assert set(only(diagnostics, ["accuracy"])["metric"]) == {"accuracy", "test_samples"}


def test_values_are_those_of_one_learner_on_one_set_by_seed(diagnostics):
    values = values_by_seed(diagnostics, "ycb", "learner_forest", "in_distribution+source", RHO)
    assert values.to_dict() == {0: 0.10, 1: 0.11, 2: 0.15}
    assert values_by_seed(diagnostics, "linemod", "learner_forest", "source", RHO).empty


def test_only_accuracies_are_printed_in_per_cent():
    assert [printed_scale(metric) for metric in ("accuracy", "ece", RHO)] == [100, 1, 1]


def test_sets_that_are_joined_have_the_samples_of_both(diagnostics):
    assert samples_of_seed(diagnostics, "ycb", "objects") == 40
    assert samples_of_seed(diagnostics, "ycb", "seen_objects+objects") == 80
    with pytest.raises(ValueError, match="NaN"):
        samples_of_seed(diagnostics, "linemod", "objects")


def test_the_footnote_names_the_samples_of_every_set_that_there_is(diagnostics):
    table = TableBuilder("table5", {"source": "Dataset"})
    table.add_row([("ycb", "YCB")], {"a": plain_cell(1.0, 3, 120)})
    without = diagnostics[diagnostics["table"] != "learners/severity"]
    note = repeats_note(table, without)
    assert "40 in distribution, 40 source, 40 seen objects, 40 objects" in note and "severity" not in note
