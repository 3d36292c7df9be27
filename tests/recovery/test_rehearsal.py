"""Rehearsed failures: the threshold that is chosen on them, and what their labels are worth."""

import numpy as np
import pandas as pd
import pytest

from gpca.causes.policy import DOUBTED, DRAWN
from gpca.classifier.scores import Attribution
from gpca.errors import InputError
from gpca.experiments.recovery_measures import read_queues
from gpca.io.csv_file import write_csv
from gpca.pairs.perturbation import CONCEPTS
from gpca.recovery.answers import LoopExplainers
from gpca.recovery.chances import FailureGate, Trial
from gpca.recovery.policies import Means
from gpca.recovery.rehearsal import BATCH, DRAWS, ChancesLearner, Rehearsal, error_by_labels, robot_policy, summary

SECTION = {
    "thresholds": {"uncertain": None, "queued_share": 0.5, "dominant": 0.4, "improvement": 0.3},
    "treatments": {"noise": "denoise", "pose": "reinitialize", "overlap": "new_view"},
    "loop": {"budget": 3},
}


class Rehearsed:
    def __init__(self, number):
        self.number = number
        self.failed = number < 4


@pytest.fixture
def rehearsal():
    """Four failures of little uncertainty, and four others of much."""
    episodes = [Rehearsed(number) for number in range(8)]
    return Rehearsal(episodes, {}, {episode.number: 0.1 * (1 + episode.number) for episode in episodes})


def test_half_of_the_rehearsed_failures_are_above_the_threshold_unless_one_is_declared(rehearsal):
    policy = robot_policy(SECTION, rehearsal)
    assert policy.thresholds.uncertain == pytest.approx(0.2)
    assert policy.thresholds.attempts == 3
    declared = SECTION | {"thresholds": SECTION["thresholds"] | {"uncertain": 0.05}}
    assert robot_policy(declared, rehearsal).thresholds.uncertain == 0.05
    assert robot_policy(SECTION, None).thresholds.uncertain == np.inf  # without a rehearsal


def test_the_summary_says_how_often_each_explainer_is_right(rehearsal):
    said = Attribution.of_scores(CONCEPTS, np.tile([0.8, 0.1, 0.1], (30, 1)), seconds=0.0)
    explainers = LoopExplainers({}, {}, {}, {"gpca": said}, np.array([CONCEPTS[0]] * 15 + [CONCEPTS[1]] * 15))
    gate = FailureGate(None, 0.75)
    means = Means(robot_policy(SECTION, rehearsal), ("denoise", "new_view"), None, ("new_view", "denoise"), gate)
    content = summary(means, explainers)
    assert content["order"] == ["new_view", "denoise"]
    assert content["thresholds"]["gate"] == 0.75
    assert content["calibration_accuracy"] == {"gpca": 0.5}
    assert content["calibration_samples"] == 30
    assert content["treatments"] == SECTION["treatments"]


COSTS = {"denoise": 0.01, "new_view": 0.02}


class Queued:
    failed = True


@pytest.fixture
def rows():
    """Twelve queued cases of which new_view always helps, four others that it solves too."""
    trials = [[Trial(np.zeros(2), a, a == "new_view") for a in COSTS] for _ in range(12)]
    learners = {"utility": lambda: ChancesLearner(trials, [np.zeros(2)] * 4, COSTS)}
    rehearsal = Rehearsal([Queued()] * 12, dict(enumerate(trials)))
    return error_by_labels(learners, [{"denoise": False, "new_view": True}] * 4, rehearsal, ("tiny", 0))


def test_the_error_falls_with_the_labels_that_are_learned(rows):
    assert set(rows["order"]) == {DOUBTED, DRAWN}
    for _, curve in rows.groupby(["order", "draw"]):
        assert curve["labels"].tolist() == list(range(0, 13, BATCH))
        assert curve["unsolved"].tolist() == [4, 0, 0, 0]  # without a label the cheapest action is taken
    assert len(rows) == (1 + DRAWS) * 4
    assert error_by_labels({}, [], None, ()).empty


def test_seeds_are_pooled_at_the_numbers_that_all_have(rows, tmp_path):
    paths = [tmp_path / f"queue_seed{seed}.csv" for seed in (0, 1)]
    write_csv(paths[0], rows)
    write_csv(paths[1], rows[rows["labels"] < 8].assign(unsolved=2))
    queues = read_queues(paths).set_index(["order", "labels"])
    assert queues.loc[DOUBTED, "error"].tolist() == [6 / 8, 2 / 8]
    assert queues.loc[(DRAWN, 4), "failures"] == 8
    assert (queues["low"] <= queues["error"]).all()
    assert (queues["error"] <= queues["high"]).all()
    write_csv(paths[1], pd.DataFrame(columns=rows.columns))
    with pytest.raises(InputError, match="has no rows"):
        read_queues(paths[1:])
