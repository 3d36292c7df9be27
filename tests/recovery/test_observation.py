from dataclasses import replace

import numpy as np

from gpca.experiments.recovery.cases import RobotIn
from gpca.recovery.actions import OBSERVED, observe


def observed(situation, holding, record, seed=0):
    numbers = observe(holding, record, RobotIn(situation), np.random.default_rng(seed))
    return dict(zip(OBSERVED, numbers, strict=True))


def test_a_wrong_pose_loses_to_a_rival_and_a_right_one_does_not(start):
    situation, outcome = start
    wrong = observed(situation, outcome.holding, outcome.record)
    right = observed(situation, replace(outcome.holding, T_world_object=situation.T_world_object), outcome.record)
    assert wrong["rival_gain"] > 0.1 > right["rival_gain"]
    assert wrong["rival_distance"] > right["rival_distance"]
    assert all(0 <= numbers["rivals"] <= 1 for numbers in (wrong, right))
    assert np.isfinite([*wrong.values()]).all()


def test_what_is_observed_hangs_on_the_named_random_numbers_alone(start):
    situation, outcome = start
    assert observed(situation, outcome.holding, outcome.record) == observed(situation, outcome.holding, outcome.record)
