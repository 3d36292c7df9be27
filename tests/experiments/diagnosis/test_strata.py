"""Table IX by parts of the samples, and by the registration that is shown."""

import numpy as np
import pytest

from gpca.causes.judged import CEILING
from gpca.causes.truth import BORDERLINE, FAILED, NOMINAL
from gpca.evaluation.measures import write_metrics
from gpca.experiments.diagnosis.metrics import collect_intervals
from gpca.experiments.diagnosis.strata import collect_strata, read_strata, strata_of
from gpca.experiments.diagnosis.strata_tables import table9_shown, table9_strata
from tests.judged import write_run

SOURCES = {"four": {"title": "Four", "stand_in": True}}
EXPLAINERS = {"right": "Right", "always_pose": "Pose"}


def test_each_kind_of_stratum_divides_the_failed_and_the_states_all_that_is_judged(judged):
    failed = ~np.isin(judged.label, (NOMINAL, BORDERLINE))
    by_kind = {}
    for (kind, _), mask in strata_of(judged).items():
        by_kind.setdefault(kind, []).append(mask)
    for kind, masks in by_kind.items():
        counts = np.sum(masks, axis=0)
        expected = judged.label != BORDERLINE if kind == "state" else failed
        assert np.array_equal(counts, expected.astype(int)), kind
    assert (judged.shown[strata_of(judged)["shown", "other"]] != FAILED).all()


@pytest.fixture
def run(causes, tmp_path):
    return write_run(tmp_path, causes)


def test_strata_are_written_read_and_tabled(run, causes, tmp_path):
    write_metrics(collect_strata(*run), tmp_path / "strata.csv")
    strata = read_strata(tmp_path / "strata.csv")
    right = strata[(strata["method"] == "right") & (strata["metric"] == "named_right")]
    assert (right["value"] == 1).all() and {"state", "margin", "causes"} <= set(right["kind"])
    table = table9_strata(strata, SOURCES, EXPLAINERS)
    assert list(table.columns)[1:] == [
        "right_named_right",
        "right_regret",
        f"{CEILING}_named_right",
        f"{CEILING}_regret",
    ]
    tested = causes.truth.state[causes.rows("test")]
    rows = {tuple(key for key, _ in labels): row for row, labels in enumerate(table.rows)}
    assert table.cells[rows["state", "nominal"], "samples"].mean == (tested == NOMINAL).sum()
    assert (rows["state", "nominal"], "right_regret") not in table.cells
    assert "procedural stand-in" in table.caption and "without borderline samples" in table.markdown()


def test_the_state_is_told_by_the_mean_and_by_what_is_shown(run):
    table = table9_shown(collect_intervals(*run), SOURCES, EXPLAINERS)
    assert table.cells[0, "state_accuracy"].mean == 100 > table.cells[1, "state_accuracy"].mean
    assert {"state_accuracy_shown", "auroc_failed_shown"} <= {key for _, key in table.cells}
