"""The threshold is chosen on failed calibration samples, or on all where hardly any failed."""

import numpy as np
import pytest

from gpca.attribution.scores import Attribution
from gpca.pairs.perturbation import CONCEPTS
from gpca.recovery.calibration import FEWEST_FAILED, robot_policy, summary
from gpca.recovery.loop_explainers import LoopExplainers

SECTION = {
    "thresholds": {"uncertain": None, "queued_share": 0.5, "dominant": 0.4, "improvement": 0.3},
    "treatments": {"noise": "denoise", "pose": "reinitialise", "overlap": "new_view"},
    "loop": {"budget": 3},
}
BALD = np.r_[np.full(20, 0.1), np.linspace(0.5, 0.7, FEWEST_FAILED)]


@pytest.fixture
def explainers():
    scores = np.tile([0.8, 0.1, 0.1], (len(BALD), 1))
    said = Attribution.of_scores(CONCEPTS, scores, seconds=0.0)
    said.bald_N[:] = BALD
    truth = np.array([CONCEPTS[0]] * 15 + [CONCEPTS[1]] * 15)
    return LoopExplainers({}, {}, {}, {"gpca": said}, truth)


def test_failed_samples_choose_the_threshold(explainers):
    failed = BALD >= 0.5
    policy = robot_policy(SECTION, explainers, failed)
    assert 0.5 < policy.thresholds.uncertain < 0.7
    assert policy.thresholds.attempts == 3


def test_all_samples_choose_it_where_hardly_any_failed(explainers):
    failed = (BALD >= 0.5) & (BALD < 0.7)
    assert robot_policy(SECTION, explainers, failed).thresholds.uncertain == pytest.approx(0.1)


def test_without_gpca_nothing_is_too_uncertain(explainers):
    other = LoopExplainers({}, {}, {}, {"softmax_head": explainers.calibration["gpca"]}, explainers.concepts)
    assert robot_policy(SECTION, other, np.ones(len(BALD), bool)).thresholds.uncertain == np.inf


def test_the_summary_says_how_often_each_explainer_is_right(explainers):
    content = summary(robot_policy(SECTION, explainers, BALD > 0), explainers)
    assert content["calibration_accuracy"] == {"gpca": 0.5}
    assert content["calibration_samples"] == len(BALD)
    assert content["treatments"] == SECTION["treatments"]
