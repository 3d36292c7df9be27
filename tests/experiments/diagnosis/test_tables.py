import numpy as np
import pandas as pd
import pytest

from gpca.causes.judged import CEILING
from gpca.errors import InputError
from gpca.evaluation.measures import POOLED
from gpca.experiments.diagnosis.feature_tables import table9_features
from gpca.experiments.diagnosis.metrics import COLUMNS
from gpca.experiments.diagnosis.tables import table9_causes

SOURCES = {"ycb": {"title": "YCB", "stand_in": True}}
EXPLAINERS = {"good": "Good", "poor": "Poor", "gate": "Gate"}
CALLS = {"good": 0, "poor": 56, "gate": 12}
COSTS = {name: {"sees": "pair + motion", "icp_calls": calls} for name, calls in CALLS.items()}
APART = (0.2, 0.15, 0.3)


def rows(source, method, rival, **values):
    samples = {"false_alarm_rate": 90, "dominant_accuracy": 160}
    others = (rival, *APART, "rule", *APART)
    return [
        (source, method, metric, samples.get(metric, 250), 5, value, value - 0.1, value + 0.05, *others)
        for metric, value in values.items()
    ]


@pytest.fixture
def intervals():
    found = []
    for source in ("ycb", POOLED):
        found += rows(source, CEILING, "", balanced_accuracy=0.95, auroc_failed=0.99)
        found += rows(source, "good", "poor", regret=0.1, balanced_accuracy=0.8, auroc_failed=0.9, false_alarm_rate=0.1)
        found += rows(source, "poor", "good", regret=0.3, balanced_accuracy=0.6, auroc_failed=0.7, false_alarm_rate=0.4)
        found += rows(source, "gate", "good", auroc_failed=0.75, false_alarm_rate=0.3)
    frame = pd.DataFrame(found, columns=list(COLUMNS))
    without = frame["method"] == CEILING
    frame.loc[without, ["difference", "difference_low", "difference_high", "gain", "gain_low", "gain_high"]] = np.nan
    return frame


def test_the_best_rival_is_bold_and_the_ceiling_is_none(intervals):
    table = table9_causes(intervals, SOURCES, EXPLAINERS, COSTS)
    text = table.markdown()
    assert (
        "| Good | pair + motion | **10.0 (0.0 to 15.0)** | – | **80.0 (70.0 to 85.0)** | 20.0 (15.0 to 30.0) |" in text
    )
    assert "| Truth from other starts (counterfactual access) | truth | – | – | 95.0 (85.0 to 100.0) | – | – |" in text
    assert "**10.0 (0.0 to 15.0)**" in text and "**40.0 (30.0 to 45.0)**" not in text  # the fewest false alarms
    assert "Gate | pair + motion | – | – | – | – | – | – | 30.0 (20.0 to 35.0) | 0.750 (0.650 to 0.800) |" in text


def test_what_is_judged_is_counted_by_measure(intervals):
    table = table9_causes(intervals, SOURCES, EXPLAINERS, COSTS)
    assert table.cells[0, "samples"].mean == 250
    assert table.cells[0, "false_alarm_rate"].test_samples == 90
    assert "over 5 seeds" in table.footnotes[0]
    assert "90 are nominal and 160 failed on YCB (procedural stand-in)" in table.footnotes[0]
    twice = pd.concat([intervals, intervals[intervals["source"] == "ycb"].assign(source="cups")])
    of_both = table9_causes(twice, SOURCES | {"cups": {"title": "Cups", "stand_in": False}}, EXPLAINERS, COSTS)
    assert "90 are nominal and 160 failed on each dataset." in of_both.footnotes[0]


def test_the_calibration_error_is_a_share(intervals):
    found = rows("ycb", "good", "poor", nominal_calibration=0.0284)
    both = pd.concat([intervals, pd.DataFrame(found, columns=list(COLUMNS))])
    text = table9_causes(both, SOURCES, EXPLAINERS, COSTS).markdown()
    assert "| ECE (share) | ICP calls | n |" in text and "| 0.028 | 0 | 250 |" in text


def test_the_bounds_in_the_csv_are_those_of_the_bootstrap(intervals):
    table = table9_causes(intervals, SOURCES, EXPLAINERS, COSTS)
    [record] = [r for r in table.records() if (*r[:2], r[3]) == ("ycb", "good", "balanced_accuracy")]
    assert record[4:7] == pytest.approx((80, 70, 85))


def test_what_is_read_is_shown_with_its_price(intervals):
    table = table9_features(intervals, SOURCES, EXPLAINERS, COSTS)
    text = table.markdown()
    assert text.index("All together") < text.index("YCB (procedural")
    assert "| All together | Poor | 56 | 30.0 (20.0 to 35.0) | – | 60.0 (50.0 to 65.0) | 20.0 (15.0 to 30.0) |" in text
    assert "Truth" not in text
    with pytest.raises(InputError, match="has nothing to show"):
        table9_features(intervals[intervals["method"] == "other"], SOURCES, EXPLAINERS, COSTS)


def test_how_near_to_chance_the_rule_is_among_the_failed_is_said(intervals):
    def told(value):
        of_rule = [row for source in ("ycb", POOLED) for row in rows(source, "rule", "good", dominant_accuracy=value)]
        both = pd.concat([intervals, pd.DataFrame(of_rule, columns=list(COLUMNS))])
        return table9_causes(both, SOURCES, EXPLAINERS | {"rule": "Rule"}, COSTS | {"rule": COSTS["good"]}).markdown()

    assert "right in 36.0 % (26.0 to 41.0), which is +2.7 points from chance; the interval ends within 10" in told(0.36)
    assert "right in 40.0 % (30.0 to 45.0), which is +6.7 points from chance; the interval reaches beyond" in told(0.4)
    assert "| Dominant (%), chance 33.3 |" in told(0.36) and "| 36.0 (26.0 to 41.0) |" in told(0.36)
    assert "There the untrained rule" not in table9_causes(intervals, SOURCES, EXPLAINERS, COSTS).markdown()


def test_intervals_of_other_explainers_make_no_table(intervals):
    with pytest.raises(InputError, match="has nothing to show"):
        table9_causes(intervals[intervals["method"] == "other"], SOURCES, EXPLAINERS, COSTS)
