"""Tables XII."""

import numpy as np
import pandas as pd
import pytest

from gpca.alignment.methods.registry import method_entry
from gpca.errors import InputError
from gpca.experiments.estimator_tables import table12_failures, table12_references, table12_uncertainty
from gpca.experiments.estimators import COLUMNS, GATES, TRUTH
from gpca.uncertainty.estimates import KINDS, REFERENCES
from gpca.uncertainty.estimators.registry import estimator_entry

from .runs import run_with

ESTIMATES = ("censi", "brossard", "stein_icp")
METHODS = ("point_to_point", "point_to_plane")
RUN = run_with(
    estimators=dict.fromkeys(ESTIMATES),
    estimator_pairs={"repeats": 200, "methods": dict.fromkeys(METHODS, 9)},
    success={"error": 0.03},
)
OF_KIND = {"starts": 1.0, "data": 2.0, "all": 4.0, TRUTH: 8.0}


@pytest.fixture
def intervals():
    rows = []
    for method in METHODS:
        for k, name in enumerate((*REFERENCES, *ESTIMATES)):
            for state, samples in (("succeeded", 30), ("failed", 10)):
                own = (method, state, name)
                for kind, size in OF_KIND.items():
                    for metric in ("nne", "nees", *(() if kind == TRUTH else ("kl_rotation", "kl_translation"))):
                        value = size + k / 10 + 100 * (state == "failed")
                        rows.append((*own, f"{metric}_{kind}", samples, 3, value, 0.5 * value, 1.2 * value))
                    share = size / 10
                    rows.append((*own, f"coverage_{kind}", samples, 3, share, 0.9 * share, 1.1 * share))
                rows.append((*own, "no_estimate", samples + 2, 3, 0.125 * (state == "failed"), np.nan, np.nan))
        for name in (*ESTIMATES, *GATES):
            rows.append((method, "both", name, "auroc_failed", 40, 3, 0.7, 0.6, 0.8, "gate_rmse", -0.1, -0.2, 0.05))
            rows.append((method, "both", name, "spearman_error", 40, 3, 0.5, np.nan, np.nan))
    return pd.DataFrame(
        [(*row, *("", np.nan, np.nan, np.nan)[: len(COLUMNS) - len(row)]) for row in rows], columns=COLUMNS
    )


def test_an_estimator_is_judged_by_what_it_models_and_states_stand_apart(intervals):
    table = table12_uncertainty(RUN, intervals)
    names = [tuple(key for key, _ in labels) for labels in table.rows]
    assert names[:4] == [
        ("point_to_point", "succeeded", "censi", "data"),
        ("point_to_point", "succeeded", "brossard", "starts and data"),
        ("point_to_point", "succeeded", "stein_icp", "posterior"),
        ("point_to_point", "failed", "censi", "data"),
    ]
    assert [table.cells[row, "kl_rotation"].mean for row in range(4)] == pytest.approx([2.3, 4.4, 2.5, 102.3])
    assert [table.cells[row, "coverage"].mean for row in range(3)] == pytest.approx([20, 40, 20])
    assert table.cells[0, f"coverage_{TRUTH}"].mean == pytest.approx(80)
    assert [table.cells[row, "samples"].mean for row in (0, 3)] == [30, 10]
    assert {row for row, key in table.best() if key == "kl_rotation"} == {0, 3, 6, 9}
    text = table.markdown()
    assert "Failed: an error of 3 % of the diameter or more" in text
    assert "judged by 200 further registrations" in text
    assert "stand-in" in text


def test_every_estimator_stands_beside_every_reference_and_these_beside_each_other(intervals):
    table = table12_references(RUN, intervals)
    names = [labels[1][0] for labels in table.rows]
    assert names[:6] == [*REFERENCES, *ESTIMATES]
    assert [table.cells[3, f"kl_rotation_{kind}"].mean for kind in KINDS] == pytest.approx([1.3, 2.3, 4.3])
    for row, kind in enumerate(KINDS):
        assert (row, f"kl_rotation_{kind}") not in table.cells  # of itself from itself
    assert min(row for row, _ in table.best()) >= len(REFERENCES)  # they compete with none
    assert table.printed()["heads"][3] == "Other starts: KL, rotation"
    assert table.printed()["heads"][-1] == "True pose: coverage (%)"


def test_an_alarm_stands_beside_the_gates(intervals):
    seconds = pd.DataFrame(
        [(name, method, 0.02) for name in ESTIMATES for method in METHODS], columns=["estimator", "method", "seconds"]
    )
    table = table12_failures(RUN, intervals, seconds)
    assert [labels[1][0] for labels in table.rows] == [*ESTIMATES, *GATES] * 2
    assert table.rows[0][0] == ("point_to_point", f"{method_entry(METHODS[0]).title}: 32 succeeded, 12 failed")
    lead = table.cells[0, "lead"]
    assert (lead.mean, lead.bounds) == (-0.1, (-0.2, 0.05))
    assert table.cells[0, "milliseconds"].mean == pytest.approx(20)
    assert table.cells[0, "no_estimate"].mean == pytest.approx(100 * 0.125 * 12 / 44)
    assert (3, "milliseconds") not in table.cells  # a gate costs nothing
    assert "| 0.700 (0.600 to 0.800) | -0.100 (-0.200 to 0.050) |" in table.markdown()


def test_an_estimator_that_refuses_all_has_no_row_and_is_named(intervals):
    refused = (intervals["estimator"] == "censi") & (intervals["method"] == "point_to_plane")
    left = intervals[~(refused & (intervals["metric"] != "no_estimate"))]
    table = table12_uncertainty(RUN, left)
    assert ("point_to_plane", "censi") not in {(labels[0][0], labels[2][0]) for labels in table.rows}
    censi, plane = estimator_entry("censi").title, method_entry("point_to_plane").title
    assert f"Left out, as they refuse every registration: {censi}, of {plane}." in table.markdown()
    assert "Left out" not in table12_uncertainty(RUN, intervals).markdown()
    with pytest.raises(InputError, match="has nothing to show"):
        table12_uncertainty(RUN, intervals[intervals["method"] == "none"])
