import math

import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.reporting.tables.builder import INTERVAL, TableBuilder, mean_over
from gpca.reporting.tables.cells import cell_of_repeats, plain_cell
from gpca.reporting.tables.table import Cell, Column
from gpca.reporting.words import span

HEADS = {"source": "Dataset", "explainer": "Explainer"}
SOURCES = {"ycb": {"title": "YCB", "stand_in": True}, "linemod": {"title": "LINEMOD", "stand_in": False}}


def labels(source, explainer):
    return [(source, source.upper()), (explainer, explainer.title())]


def cells(**means):
    return {key: None if mean is None else plain_cell(mean, 3, 600) for key, mean in means.items()}


@pytest.fixture
def builder():
    builder = TableBuilder("table9", HEADS)
    builder.add_row(labels("ycb", "oracle"), cells(a=99, b=1), rival=False)
    builder.add_row(labels("ycb", "gpca"), cells(a=90, b=95))
    builder.add_row(labels("ycb", "shap"), cells(a=80, b=None))
    builder.add_row(labels("linemod", "gpca"), cells(a=70, b=60))
    builder.add_row(labels("linemod", "shap"), cells(a=71, b=61))
    return builder


def built(builder, **options):
    columns = {"a": Column("A"), "b": Column("B")}
    return builder.build(**{"caption": "T", "column_head": "metric", "columns": columns, "footnotes": ["n"]} | options)


def test_a_table_has_the_rows_that_have_a_cell_in_their_order_and_without_any_is_refused(builder):
    table = built(builder)
    assert (table.name, table.caption, table.row_heads, table.column_head) == ("table9", "T", HEADS, "metric")
    assert [row[0][0] + " " + row[1][1] for row in table.rows] == [
        "ycb Oracle", "ycb Gpca", "ycb Shap", "linemod Gpca", "linemod Shap",
    ]  # fmt: skip
    assert table.cells[1, "b"].mean == 95
    assert (2, "b") not in table.cells
    assert table.footnotes == ("n",)
    assert "| YCB | Shap | 80.0 | – |" in table.markdown()
    builder.add_row(labels("cups", "gpca"), cells(a=None, b=None))
    builder.add_row(labels("cups", "shap"), {})
    builder.add_row(labels("cups", "oracle"), cells(b=5))
    assert [row[1][0] for row in builder.labels] == ["oracle", "gpca", "shap", "gpca", "shap", "oracle"]
    assert built(builder).cells[5, "b"].mean == 5
    with pytest.raises(InputError, match=r"^table 'table0': has nothing to show"):
        built(TableBuilder("table0", HEADS))


@pytest.mark.parametrize(
    ("comparison", "best"),
    [
        ({"across": ["a", "b"]}, {(0, "a"), (1, "b"), (3, "a"), (4, "a")}),  # oracles too
        ({"down": ["a"], "same": 1}, {(1, "a"), (4, "a")}),
        ({"down": ["a", "b"]}, {(1, "a"), (1, "b")}),
        ({}, set()),
    ],
)
def test_across_the_columns_of_a_row_all_compete_and_down_a_column_the_rivals_whose_first_labels_agree(
    builder, comparison, best
):
    builder.compare_across(comparison.get("across", ()))
    builder.compare_down(comparison.get("down", ()), same=comparison.get("same", 0))
    assert built(builder).best() == best


def test_a_cell_has_the_mean_of_repeats_and_the_bounds_of_an_interval_but_beside_a_heavy_tail():
    cell = cell_of_repeats([97.0, 98.0, 99.0], 600)
    assert (cell.mean, cell.seeds, cell.test_samples, cell.at_least) == (98, 3, 600, False)
    assert cell.half_width == pytest.approx(4.302653 / math.sqrt(3), abs=1e-5)
    assert cell_of_repeats(pd.Series([1.0, 2.0]), 2, at_least=True).at_least
    assert math.isnan(cell_of_repeats([5.0], 200).half_width)
    assert math.isnan(cell_of_repeats([5.0, 6.0], 400).half_width)
    assert cell_of_repeats([5.0, 6.0], 400).mean == 5.5
    assert cell_of_repeats([], 200) is None
    assert math.isnan(plain_cell(0.25, 3, 600).half_width)
    cell = Cell(76.9, 10.8, 1, 200, bounds=(64.9, 86.3))
    assert Column("A").text(cell) == "76.9 (64.9 to 86.3)"
    assert Column("A", interval=False).text(cell) == "76.9"
    change = Column("A", limits=(-100, 100), beside="b")
    assert change.text(Cell(-21.7, 10.8, 1, 200, bounds=(-34.2, -12.5))) == "-21.7; -34.2 to -12.5"
    assert change.text(Cell(1.25, 0.5, 3, 600)) == "+1.2 ± 0.5"
    assert change.text(Cell(-0.01, 0.02, 1, 200, bounds=(-0.03, 0.01))) == "+0.0; 0.0 to 0.0"  # and no -0.0
    heavy = Column("KL", 2, limits=(0, math.inf), heavy_tail=True)
    assert heavy.text(Cell(7.56, 7.02, 5, 100)) == "7.56 ± 7.02"
    assert heavy.text(Cell(658.3, 1239.3, 5, 100)) == "658.30"
    assert Column("A").text(Cell(1.0, 2.0, 5, 100)) == "1.0 ± 2.0"


def test_means_over_few_seeds_and_what_all_share_are_not_bold():
    builder = TableBuilder("table9", HEADS)
    for name, bounds in (("gpca", None), ("shap", None), ("forest", (1.0, 9.0)), ("svm", (0.0, 5.0))):
        labels_of = labels("ycb" if bounds is None else "linemod", name)
        builder.add_row(labels_of, {"a": Cell(len(name), 1.0, 2, 400, bounds=bounds)})
    builder.compare_down(["a"], same=1)
    assert built(builder).best() == {(2, "a")}
    builder = TableBuilder("table9", HEADS)
    builder.add_row(labels("ycb", "gpca"), cells(a=4, b=4))
    builder.add_row(labels("ycb", "shap"), cells(a=4, b=5))
    builder.compare_across("ab")
    assert built(builder).best() == {(1, "b")}


NONE = "with fewer than 3 there is no interval and no bold"


@pytest.mark.parametrize(
    ("seeds", "samples", "words"),
    [
        (1, 200, f"Mean over 1 seed, 200 test samples each; {NONE}"),
        (2, 200, f"Mean over 2 seeds, 200 test samples each; {NONE}"),
        (5, 200, f"Mean over 5 seeds, 200 test samples each; {INTERVAL}"),
    ],
)
def test_the_footnote_counts_seeds_and_samples(seeds, samples, words):
    assert mean_over(seeds, samples) == words


def test_the_seeds_and_samples_of_cells_are_told_as_a_span(builder):
    builder.add_row(labels("cups", "gpca"), {"a": plain_cell(1, 5, 10), "b": plain_cell(1, 2, 10)})
    assert builder.seeds == 5
    assert (span([7.0, 7.0]), span([60, 15, 30])) == ("7", "15 to 60")
