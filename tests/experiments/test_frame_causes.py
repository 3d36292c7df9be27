"""Table IX on depth frames: kinds of starts apart, and nothing concluded from few failures."""

import numpy as np
import pandas as pd
import pytest

from gpca.causes.judged import CEILING
from gpca.errors import InputError
from gpca.evaluation.measures import AGAINST, KEYS, NUMBERS
from gpca.experiments import frame_causes
from gpca.experiments.frame_causes import COUNTED, PSEUDO, TRUTH, table9_frame_counts, table9_frames
from tests.experiments.runs import run_with

RUN = run_with()
APART = (0.2, 0.15, 0.3)
MANY = {"starts": 90, "instances": 30, "scenes": 3, "nominal": 20, "borderline": 29, "pose": 30, "noise": 6}
MANY |= {"overlap": 4, "geometry": 1, "missed": 5}
FEW = MANY | {"starts": 60, "pose": 19, "nominal": 1}


def counts(source, values):
    return [
        ("causes", source, TRUTH, f"count_{name}", "all", "", "", 1, 3, 90, values.get(name, 0), np.nan, np.nan)
        for name in COUNTED
    ]


def measures(source, method, rival, **values):
    records = []
    for metric, value in values.items():
        keys, sizes = ("causes", source, method, metric, "all"), (1, 3, 60)
        records.append((*keys, "", "", *sizes, value, value - 0.1, value + 0.05))
        records += [(*keys, "rival", rival, *sizes, *APART)] if rival else []
    return records


@pytest.fixture
def intervals(monkeypatch):
    titles = {"good": "Good", "poor": "Poor"}
    monkeypatch.setattr(frame_causes, "cause_titles", lambda config: titles)
    costs = {name: {"sees": "pair", "icp_calls": 0} for name in titles}
    monkeypatch.setattr(frame_causes, "cause_costs", lambda config, names: costs)
    rows = []
    for kind, values in {"native": FEW, "ladder": MANY}.items():
        source = f"real_rgbd/{kind}"
        rows += counts(source, values) + counts(f"{source}/ycbv", values)
        rows += measures(source, "good", "poor", test_samples=60, state_accuracy=0.8, dominant_accuracy=0.6)
        rows += measures(source, "poor", "good", test_samples=60, state_accuracy=0.6, dominant_accuracy=0.4)
        rows += measures(source, CEILING, "", state_accuracy=0.95)
    rows += counts(f"real_rgbd/{PSEUDO}", {"starts": 7, "pose": 7}) + counts(f"real_rgbd/{PSEUDO}/icbin", {"starts": 7})
    return pd.DataFrame(rows, columns=[*KEYS, *AGAINST, *NUMBERS])


def test_kinds_of_starts_stand_apart_with_their_failures_and_few_make_no_best(intervals):
    text = table9_frames(RUN, intervals).markdown()
    few = "| Estimated in the image (29 failed, too few) | Good | pair | 80.0 (70.0 to 85.0) | 20.0 (15.0 to 30.0) |"
    assert few in text
    assert "| Ladder of errors (40 failed) | Good | pair | **80.0 (70.0 to 85.0)** |" in text
    assert "Truth from other starts (counterfactual access) | truth | 95.0 (85.0 to 100.0) | – |" in text
    assert "below 30 failures nothing is concluded" in text
    assert "icbin" not in text
    assert "Ladder of errors: 90 starts of 30 instances in 3 scenes; 20 nominal, 29 borderline, 1 off without" in text
    assert (
        "40 failed: 6 mostly by noise, 30 mostly by pose, 4 mostly by overlap. One constant answer names 75 %" in text
    )


def test_counts_are_of_kinds_and_datasets_and_without_any_there_is_no_table(intervals):
    text = table9_frame_counts(RUN, intervals).markdown()
    assert "| Ladder of errors | All | 90 | 30 | 3 | 20 | 29 | 40 | 6 | 30 | 4 | 1 | 5 |" in text
    assert "| Ladder of errors | YCB-Video | 90 |" in text
    assert "| Truth made by ICP | All | 7 |" in text
    assert "| Carried over" not in text
    other = intervals.assign(source="ycb")
    for build in (lambda: table9_frames(RUN, other), lambda: table9_frame_counts(RUN, other)):
        with pytest.raises(InputError, match="has nothing to show"):
            build()
