"""Actions of a robot, and what it observes."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.recovery import actions
from gpca.recovery.actions import ACTIONS, OBSERVED, Robot, action_of, observe
from gpca.recovery.episodes import register_after, register_held
from gpca.rigid import inverse, rotation_angle_rad
from tests.failures import LOOP

from ..documents import block


@pytest.mark.parametrize("settings", [{"starts": 48}, {"starts": 1, "posterior": True}])
def test_a_broader_search_finds_what_explains_the_shots(start, settings):
    situation, outcome = start
    found = ACTIONS["reinitialize"](outcome.holding, Robot(situation), np.random.default_rng(0), **settings)
    assert register_held(situation, found, LOOP).error < outcome.error
    assert found.shots is outcome.holding.shots


def test_a_new_view_is_fused_with_the_old_one_and_shows_more(start):
    situation, outcome = start
    d = situation.diameter_m
    result = register_after(situation, outcome, ACTIONS["new_view"], ("new_view",), replace(LOOP, cloud_points=4000))
    first_shot, new = result.holding.shots
    assert first_shot is outcome.holding.shots[0]
    turned = rotation_angle_rad(inverse(first_shot.T_world_camera) @ new.T_world_camera)
    assert np.rad2deg(turned) > 30
    both = len(first_shot.object_points_m(d)) + len(new.object_points_m(d))
    assert len(result.record["cloud"]) == min(4000, both)


def test_denoising_takes_more_frames_each_time_and_keeps_doing_so(start):
    situation, outcome = start
    once = register_after(situation, outcome, ACTIONS["denoise"], ("denoise",), LOOP)
    twice = register_after(situation, once, ACTIONS["denoise"], ("denoise", "denoise"), LOOP)
    assert (once.holding.frames, twice.holding.frames) == (10, 20)
    assert once.holding.filtered
    looked = register_after(situation, once, ACTIONS["new_view"], ("denoise", "new_view"), LOOP)
    assert looked.holding.frames == 10


def test_the_action_of_the_documentation_sees_the_object_from_closer(start):
    situation, outcome = start
    added = dict(vars(actions)) | {"ACTIONS": dict(ACTIONS)}
    exec(block("gpca/recovery/actions.py"), added)
    result = register_after(situation, outcome, added["ACTIONS"]["closer"], ("closer",), LOOP)
    away, near = result.holding.shots
    assert away is outcome.holding.shots[0]
    assert near.mask.sum() > 1.5 * away.mask.sum()


@pytest.mark.parametrize(
    ("name", "given", "fault"),
    [("pray", {}, "unknown; choose one of reinitialize"), ("denoise", {"framse": 3}, "did you mean frames")],
)
def test_unknown_actions_and_settings_are_refused(name, given, fault):
    with pytest.raises(InputError, match=fault):
        action_of(name, given)


def observed(situation, holding, record, seed=0):
    numbers = observe(holding, record, Robot(situation), np.random.default_rng(seed))
    return dict(zip(OBSERVED, numbers, strict=True))


def test_a_wrong_pose_loses_to_a_rival_and_a_right_one_does_not(start):
    situation, outcome = start
    wrong = observed(situation, outcome.holding, outcome.record)
    right = observed(situation, replace(outcome.holding, T_world_object=situation.T_world_object), outcome.record)
    assert wrong["rival_gain"] > 0.1 > right["rival_gain"]
    assert wrong["rival_distance"] > right["rival_distance"]
    assert all(0 <= numbers["rivals"] <= 1 for numbers in (wrong, right))
    assert np.isfinite([*wrong.values()]).all()
    assert observed(situation, outcome.holding, outcome.record) == wrong  # by the named random numbers alone
