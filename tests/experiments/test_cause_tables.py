"""Tables IX and the figures of diagnoses."""

import pandas as pd
import pytest

from gpca.causes.judged import CEILING
from gpca.errors import InputError
from gpca.evaluation.measures import AGAINST, KEYS, NUMBERS, POOLED
from gpca.experiments import cause_tables
from tests.experiments.runs import run_with

SOURCES = {"ycb": {"title": "YCB", "stand_in": True}}
TITLES = {"good": "Good", "poor": "Poor", "gate": "Gate"}
CALLS = {"good": 0, "poor": 56, "gate": 12, "rule": 0}
APART = (0.2, 0.15, 0.3)
COLUMNS = [*KEYS, *AGAINST, *NUMBERS]


@pytest.fixture(autouse=True)
def titles(monkeypatch):
    """Titles of the explainers that the tables show, which are not registered."""
    titles = dict(TITLES)
    costs = {name: {"sees": "pair + motion", "icp_calls": calls} for name, calls in CALLS.items()}
    monkeypatch.setattr(cause_tables, "cause_titles", lambda config, key="explainers": titles)
    monkeypatch.setattr(cause_tables, "cause_costs", lambda config, names: costs)
    return titles


def rows(source, method, rival, **values):
    samples = {"false_alarm_rate": 90, "dominant_accuracy": 160}
    records = []
    for metric, value in values.items():
        keys, counts = ("causes", source, method, metric, "all"), (5, 20, samples.get(metric, 250))
        records.append((*keys, "", "", *counts, value, value - 0.1, value + 0.05))
        if rival:
            others = {"rival": rival, "trivial": "rule"}
            records += [(*keys, kind, other, *counts, *APART) for kind, other in others.items()]
    return records


def table9_causes(intervals, sources=SOURCES):
    return cause_tables.table9_causes(run_with(sources=sources), intervals)


def table9_features(intervals):
    return cause_tables.table9_features(run_with(sources=SOURCES), intervals)


@pytest.fixture
def intervals():
    records = []
    for source in ("ycb", POOLED):
        records += rows(source, CEILING, "", balanced_accuracy=0.95, auroc_failed=0.99)
        values = {"regret": 0.1, "balanced_accuracy": 0.8, "auroc_failed": 0.9, "false_alarm_rate": 0.1}
        records += rows(source, "good", "poor", **values)
        values = {"regret": 0.3, "balanced_accuracy": 0.6, "auroc_failed": 0.7, "false_alarm_rate": 0.4}
        records += rows(source, "poor", "good", **values)
        records += rows(source, "gate", "good", auroc_failed=0.75, false_alarm_rate=0.3)
    return pd.DataFrame(records, columns=COLUMNS)


def test_the_best_rival_is_bold_with_the_bounds_of_the_bootstrap_and_samples_are_counted_by_measure(intervals):
    table = table9_causes(intervals)
    text = table.markdown()
    assert "| Good | pair + motion | **10.0 (0.0 to 15.0)** | **80.0 (70.0 to 85.0)** | 20.0 (15.0 to 30.0) |" in text
    assert "| Truth from other starts (counterfactual access) | truth | – | 95.0 (85.0 to 100.0) | – | – |" in text
    assert "**10.0 (0.0 to 15.0)**" in text and "**40.0 (30.0 to 45.0)**" not in text  # the fewest false alarms
    assert "Gate | pair + motion | – | – | – | – | 30.0 (20.0 to 35.0) | 0.750 (0.650 to 0.800) |" in text
    [record] = [r for r in table.records() if (*r[:2], r[3]) == ("ycb", "good", "balanced_accuracy")]
    assert record[4:7] == pytest.approx((80, 70, 85))
    assert table.cells[0, "samples"].mean == 250
    assert table.cells[0, "false_alarm_rate"].test_samples == 90
    assert "over 5 seeds" in table.footnotes[0]
    assert "90 are nominal and 160 failed on YCB (procedural stand-in)" in table.footnotes[0]
    twice = pd.concat([intervals, intervals[intervals["source"] == "ycb"].assign(source="cups")])
    of_both = table9_causes(twice, SOURCES | {"cups": {"title": "Cups", "stand_in": False}})
    assert "90 are nominal and 160 failed on each dataset." in of_both.footnotes[0]


def test_what_is_read_is_shown_with_its_price(intervals):
    table = table9_features(intervals)
    text = table.markdown()
    assert text.index("All together") < text.index("YCB (procedural")
    assert "| All together | Poor | 56 | 30.0 (20.0 to 35.0) | 60.0 (50.0 to 65.0) | 20.0 (15.0 to 30.0) |" in text
    assert "Truth" not in text
    with pytest.raises(InputError, match="has nothing to show"):
        table9_features(intervals[intervals["method"] == "other"])


def test_how_near_to_chance_the_rule_is_among_the_failed_is_said(intervals, titles):
    assert "There the untrained rule" not in table9_causes(intervals).markdown()
    titles["rule"] = "Rule"

    def text_of(value):
        of_rule = [row for source in ("ycb", POOLED) for row in rows(source, "rule", "good", dominant_accuracy=value)]
        both = pd.concat([intervals, pd.DataFrame(of_rule, columns=COLUMNS)])
        return table9_causes(both).markdown()

    near, beyond = text_of(0.36), text_of(0.4)
    assert "right in 36.0 % (26.0 to 41.0), which is +2.7 points from chance; the interval ends within 10" in near
    assert "right in 40.0 % (30.0 to 45.0), which is +6.7 points from chance; the interval reaches beyond" in beyond
    assert "| Dominant (%), chance 33.3 |" in near and "| 36.0 (26.0 to 41.0) |" in near
