import numpy as np
import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.evaluation.measures import POOLED
from gpca.experiments.controls.metrics import COLUMNS
from gpca.experiments.controls.tables import table10_controls, table10_transfer

SOURCES = {"ycb": {"title": "YCB", "stand_in": True}, "cups": {"title": "Cups", "stand_in": True}}
EXPLAINERS = {"good": "Good", "head": "Head"}
SEES = {"good": "pair", "head": "aligned source"}
LEAD, GAIN = ("head", 0.08, 0.05, 0.1), ("rule", -0.02, -0.04, 0.01)


def row(control, source, trained_on, method, value, change=0.0, metric="accuracy", seeds=3):
    bounds = (value, value - 0.04, value + 0.02, change, change - 0.03, change + 0.01)
    return (control, source, trained_on, method, metric, 200, seeds, *bounds, *LEAD, *GAIN)


@pytest.fixture
def intervals():
    rows = []
    for source in (*SOURCES, POOLED):
        for method, value in (("good", 0.98), ("head", 0.9)):
            rows.append(row("paper", source, source, method, value))
            rows.append(row("unseen_objects", source, source, method, value - 0.1, -0.1))
            rows.append(row("transfer", source, POOLED, method, value - 0.2, -0.2))
        rows.append(row("shuffled", source, source, "good", 0.33, -0.65, seeds=1))
        rows.append(row("unseen_objects", source, source, "good", 0.875, np.nan, "auroc_error"))
    rows.append(row("transfer", "ycb", "cups", "good", 0.5, -0.4))
    rows.append(row("transfer", "cups", "ycb", "good", 0.6, -0.3))
    return pd.DataFrame(rows, columns=list(COLUMNS))


def test_a_cell_is_the_accuracy_and_in_brackets_the_change(intervals):
    table = table10_controls(intervals, SOURCES, EXPLAINERS, ["unseen_objects", "shuffled", "transfer"], SEES)
    text = table.markdown()
    assert (
        "| All together | Good | pair | **98.0** | **88.0 (-10.0; -13.0 to -9.0)** | **78.0 (-20.0; -23.0 to -19.0)** "
        "| 33.0 (-65.0; -68.0 to -64.0) |" in text
    )
    assert (
        "| YCB (procedural stand-in) | Head | aligned source | 90.0 "
        "| 80.0 (-10.0; -13.0 to -9.0) | 70.0 (-20.0; -23.0 to -19.0) | – |" in text
    )
    assert text.index("All together") < text.index("YCB (procedural")
    assert "change" not in text.splitlines()[2]
    assert text.splitlines()[2].count("|") == text.splitlines()[3].count("|")
    assert table.latex().count(r"\textbf{Paper's protocol (\%)}") == 1


def test_an_auroc_says_how_many_answers_it_had_to_find(intervals):
    text = table10_controls(intervals, SOURCES, EXPLAINERS, ["unseen_objects"], SEES).markdown()
    assert "| – | 0.88 (24 of 200) |" in text  # 12 % of 200 are wrong
    assert "wrong" not in text.splitlines()[2]


def test_the_note_says_which_controls_have_fewer_seeds(intervals):
    note = table10_controls(intervals, SOURCES, EXPLAINERS, ["unseen_objects", "shuffled"], SEES).footnotes[0]
    assert note.startswith("Over 3 seeds (Shuffled labels: 1 seed). In brackets")
    alike = intervals.assign(seeds=2)
    assert table10_controls(alike, SOURCES, EXPLAINERS, ["shuffled"], SEES).footnotes[0].startswith("Over 2 seeds. In")


def test_the_csv_holds_both_with_their_bounds(intervals):
    table = table10_controls(intervals, SOURCES, EXPLAINERS, ["unseen_objects"], SEES)
    found = {(*record[:2], record[3]): record[4:7] for record in table.records()}
    assert found["ycb", "good", "unseen_objects"] == pytest.approx((88, 84, 90))
    assert found["ycb", "good", "unseen_objects_change"] == pytest.approx((-10, -13, -9))
    assert ("ycb", "good", "transfer") not in found  # it was not run


def test_what_an_explainer_adds_stands_beside_under_two_controls(intervals):
    calls = intervals[intervals["control"] == "paper"].assign(metric="icp_calls", value=13.0)
    table = table10_controls(pd.concat([intervals, calls]), SOURCES, EXPLAINERS, ["unseen_objects", "transfer"], SEES)
    heads = table.markdown().splitlines()[2]
    assert "| Paper's protocol: over untrained (points) | Paper's protocol: lead (points) |" in heads
    assert "Unseen objects: lead (points)" in heads and "Other sources: lead" not in heads
    assert (
        "| -2.0 (-4.0 to 1.0) | 8.0 (5.0 to 10.0) | -2.0 (-4.0 to 1.0) | 8.0 (5.0 to 10.0) | 13 |" in table.markdown()
    )


def test_how_near_to_chance_the_rule_is_under_hard_is_said(intervals):
    of_rule = [row("hard", source, source, "rule", value) for source, value in (("ycb", 0.5), (POOLED, 0.4))]
    both = pd.concat([intervals, pd.DataFrame(of_rule, columns=list(COLUMNS))])
    text = table10_controls(both, SOURCES, EXPLAINERS, ["hard"], SEES).markdown()
    told = (
        "Guessing is right in 33.3 %. There the untrained rule is right in 40.0 % (36.0 to 42.0), which is +6.7 points"
    )
    assert f"{told} from chance; the interval ends within 10 points above chance." in text
    assert "There the untrained rule" not in table10_controls(intervals, SOURCES, EXPLAINERS, [], SEES).markdown()


def test_a_transfer_has_the_source_learnt_from_in_its_row(intervals):
    text = table10_transfer(intervals, SOURCES, EXPLAINERS).markdown()
    assert "| Good | YCB (procedural stand-in) | 98.0 (94.0 to 100.0) | 60.0 (56.0 to 62.0) | – |" in text
    assert "| Good | Cups (procedural stand-in) | 50.0 (46.0 to 52.0) | 98.0 (94.0 to 100.0) | – |" in text
    assert "| Good | another (mean) | 78.0 (74.0 to 80.0) | 78.0 (74.0 to 80.0) | 78.0 (74.0 to 80.0) |" in text


@pytest.mark.parametrize("make", [lambda i: table10_controls(i, SOURCES, EXPLAINERS, [], SEES),
                                  lambda i: table10_transfer(i, SOURCES, EXPLAINERS)])  # fmt: skip
def test_intervals_of_other_explainers_make_no_table(intervals, make):
    with pytest.raises(InputError, match="has nothing to show"):
        make(intervals[intervals["method"] == "other"])
