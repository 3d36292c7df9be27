"""Table X: under the controls, and from each source to each other."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from gpca.declarations.plan import Run
from gpca.evaluation.measures import AGAINST, KEYS, NUMBERS, POOLED
from gpca.experiments.control_tables import table10_controls, table10_transfer

TITLES = {"good": "Good", "head": "Head", "gpca": "GP-CA", "gpca_pair": "GP-CA on the pair"}
SEES = {"good": "pair", "head": "aligned source"}
COLUMNS = [*KEYS, *AGAINST, *NUMBERS]


@pytest.fixture(autouse=True)
def _titles(monkeypatch):
    monkeypatch.setattr(
        "gpca.experiments.control_tables.explainer_entry",
        lambda name: SimpleNamespace(sight=SEES[name], title=TITLES[name]),
    )


def run(*controls, explainers=("good", "head"), stand_in=True):
    sources = {name: {"title": title, "stand_in": stand_in} for name, title in (("ycb", "YCB"), ("cups", "Cups"))}
    return Run({"sources": sources, "controls": {"explainers": dict.fromkeys(explainers), "controls": controls}})


SOURCES = ("ycb", "cups")
LEAD, GAIN = ("rival", "head", 0.08, 0.05, 0.1), ("trivial", "rule", -0.02, -0.04, 0.01)


def rows_of(
    control, source, trained_on, method, value, change=np.nan, metric="accuracy", seeds=3, against=(LEAD, GAIN)
):
    """A value and its differences."""
    keys = (control, source, method, metric, trained_on if control == "transfer" else "all")
    usual = [("usual", "paper", change, change - 0.03, change + 0.01)] if np.isfinite(change) else []
    entries = [("", "", value, value - 0.04, value + 0.02), *usual, *((LEAD, GAIN) if metric == "accuracy" else ())]
    return [(*keys, *entry[:2], seeds, 5, 200, *entry[2:]) for entry in entries]


@pytest.fixture
def intervals():
    rows = []
    for source in (*SOURCES, POOLED):
        for method, value in (("good", 0.98), ("head", 0.9)):
            rows.extend(rows_of("paper", source, source, method, value))
            rows.extend(rows_of("unseen_objects", source, source, method, value - 0.1, -0.1))
            rows.extend(rows_of("transfer", source, POOLED, method, value - 0.2, -0.2))
        rows.extend(rows_of("shuffled", source, source, "good", 0.33, -0.65, seeds=1))
    rows.extend(rows_of("transfer", "ycb", "cups", "good", 0.5, -0.4))
    rows.extend(rows_of("transfer", "cups", "ycb", "good", 0.6, -0.3))
    return pd.DataFrame(rows, columns=COLUMNS)


def test_a_cell_is_the_accuracy_and_in_brackets_the_change_and_the_csv_holds_both(intervals):
    table = table10_controls(run("unseen_objects", "shuffled", "transfer"), intervals)
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
    table = table10_controls(run("unseen_objects"), intervals)
    found = {(*record[:2], record[3]): record[4:7] for record in table.records()}
    assert found["ycb", "good", "unseen_objects"] == pytest.approx((88, 84, 90))
    assert found["ycb", "good", "unseen_objects_change"] == pytest.approx((-10, -13, -9))
    assert ("ycb", "good", "transfer") not in found  # it was not run


def test_the_note_says_which_controls_have_fewer_seeds(intervals):
    note = table10_controls(run("unseen_objects", "shuffled"), intervals).footnotes[0]
    assert note.startswith("Over 3 seeds (Shuffled labels: 1 seed). In brackets")
    alike = intervals.assign(seeds=2)
    assert table10_controls(run("shuffled"), alike).footnotes[0].startswith("Over 2 seeds. In")


def test_what_an_explainer_adds_stands_beside_under_two_controls(intervals):
    paper = (intervals["table"] == "paper") & (intervals["against"] == "")
    calls = intervals[paper].assign(metric="icp_calls", value=13.0)
    table = table10_controls(run("unseen_objects", "transfer"), pd.concat([intervals, calls]))
    heads = table.markdown().splitlines()[2]
    assert "| Paper's protocol: over trivial (points) | Paper's protocol: lead (points) |" in heads
    assert "Unseen objects: lead (points)" in heads and "Other sources: lead" not in heads
    assert (
        "| -2.0 (-4.0 to 1.0) | 8.0 (5.0 to 10.0) | -2.0 (-4.0 to 1.0) | 8.0 (5.0 to 10.0) | 13 |" in table.markdown()
    )


def test_how_near_to_chance_the_rule_is_under_hard_is_said(intervals):
    rule = [*rows_of("hard", "ycb", "ycb", "rule", 0.5), *rows_of("hard", POOLED, POOLED, "rule", 0.4)]
    both = pd.concat([intervals, pd.DataFrame(rule, columns=COLUMNS)])
    text = table10_controls(run("hard"), both).markdown()
    told = (
        "Guessing is right in 33.3 %. There the untrained rule is right in 40.0 % (36.0 to 42.0), which is +6.7 points"
    )
    assert f"{told} from chance; the interval ends within 10 points above chance." in text
    assert "There the untrained rule" not in table10_controls(run(), intervals).markdown()


def test_a_transfer_has_the_source_learnt_from_in_its_row(intervals):
    text = table10_transfer(run(), intervals).markdown()
    assert "| Good | YCB (procedural stand-in) | 98.0 (94.0 to 100.0) | 60.0 (56.0 to 62.0) | – |" in text
    assert "| Good | Cups (procedural stand-in) | 50.0 (46.0 to 52.0) | 98.0 (94.0 to 100.0) | – |" in text
    assert "| Good | another (mean) | 78.0 (74.0 to 80.0) | 78.0 (74.0 to 80.0) | 78.0 (74.0 to 80.0) |" in text
