"""Rehearsed failures: the threshold that is chosen on them."""

import numpy as np
import pytest

from gpca.recovery.loop import Rehearsal, robot_policy

SECTION = {
    "thresholds": {"uncertain": None, "queued_share": 0.5, "dominant": 0.4, "improvement": 0.3},
    "treatments": {"noise": "denoise", "pose": "reinitialize", "overlap": "new_view"},
    "loop": {"budget": 3},
}


class Rehearsed:
    def __init__(self, number):
        self.number = number
        self.failed = number < 4


def test_half_of_the_rehearsed_failures_are_above_the_threshold_unless_one_is_declared():
    # Four failures of little uncertainty, and four others of much.
    episodes = [Rehearsed(number) for number in range(8)]
    rehearsal = Rehearsal(episodes, {}, {episode.number: 0.1 * (1 + episode.number) for episode in episodes})
    policy = robot_policy(SECTION, rehearsal)
    assert policy.thresholds.uncertain == pytest.approx(0.2)
    assert policy.thresholds.attempts == 3
    declared = SECTION | {"thresholds": SECTION["thresholds"] | {"uncertain": 0.05}}
    assert robot_policy(declared, rehearsal).thresholds.uncertain == 0.05
    assert robot_policy(SECTION, None).thresholds.uncertain == np.inf  # without a rehearsal
