from dataclasses import replace

import numpy as np
import pytest

from gpca.alignment.rigid import inverse
from gpca.experiments.recovery.cases import register_after, register_held
from gpca.recovery.actions import ACTIONS
from tests.failures import LOOP

ICP = LOOP.icp


def test_a_registration_is_that_of_its_row(start):
    situation, outcome = start
    d = situation.diameter_m
    T_target_source = outcome.record["T_target_source_icp"]
    held = outcome.holding
    assert held.T_world_object == pytest.approx(held.T_world_object_init @ inverse(T_target_source))
    T_error = inverse(outcome.record["T_target_source_true"]) @ T_target_source
    if not situation.shelf.symmetric[situation.model]:
        assert outcome.error > 0.5 * np.linalg.norm(T_error[:3, 3]) / d - 0.5
    right = replace(held, T_world_object_init=situation.T_world_object)
    assert register_held(situation, right, LOOP.cloud_points, ICP).error < 0.05


def test_an_action_gives_the_same_again(start):
    situation, outcome = start
    a, b = (
        register_after(situation, outcome, ACTIONS["new_view"], ("new_view",), LOOP.cloud_points, ICP) for _ in range(2)
    )
    assert (a.record["cloud"] == b.record["cloud"]).all()
    assert a.error == b.error
