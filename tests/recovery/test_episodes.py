from dataclasses import replace

import numpy as np
import pytest

import gpca.recovery.episodes as module
from gpca.errors import InputError
from gpca.recovery.settings import LoopSettings
from gpca.rigid import inverse
from tests.failures import LOOP

SETTINGS = LoopSettings(failures=1, good=1, tries=8, cloud_points=400)


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
    assert module.register_held(situation, right, LOOP).error < 0.05


def test_failures_have_their_cause_and_are_bounded(situations):
    episodes = module.find_episodes(situations["failures"], SETTINGS)
    assert [episode.number for episode in episodes] == list(range(len(episodes)))
    for episode in episodes:
        assert episode.failed == (episode.outcomes[()].error >= SETTINGS.success)
        assert episode.tries <= 8 * module.MISPLACED
    failures = [episode.situation.cause for episode in episodes if episode.failed]
    assert len(set(failures)) == len(failures)
    assert 0 < sum(not episode.failed for episode in episodes) <= 3


def test_a_failure_is_right_without_its_cause_and_that_registration_is_a_good_one(situations):
    failure, good, _ = next(
        found
        for number in range(40)
        if (found := module._try_situation(situations["failures"], "overlap", number, SETTINGS, 1))[0]
    )
    assert (failure[0].cause, good[0].cause) == ("overlap", "")
    assert failure[1].error >= SETTINGS.success > good[1].error
    assert failure[0].axes == good[0].axes
    assert failure[0].table == good[0].table


def test_a_bad_pose_is_put_on_the_same_measurement(situations):
    disturbed, clean = situations["failures"].draw("pose", "pose", 0)
    estimated = module.register_first(clean, LOOP)
    others = [situations["failures"].misplaced(clean, number) for number in (1, 2)]
    a, b = (module.register_misplaced(other, estimated, LOOP).holding for other in others)
    assert a.shots is b.shots is estimated.holding.shots
    assert not np.allclose(a.T_world_object_init, b.T_world_object_init)
    assert others[0].cause == disturbed.cause == "pose"


def test_no_failure_at_all_is_one_line(situations, monkeypatch):
    monkeypatch.setattr("gpca.recovery.episodes.register_first", lambda *given: None)
    with pytest.raises(InputError, match=r"no registration failed \(2 of noise, 2 of pose, 2 of overlap\)"):
        module.find_episodes(situations["failures"], LoopSettings(tries=2))
