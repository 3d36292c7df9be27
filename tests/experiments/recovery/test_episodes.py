import numpy as np
import pytest

from gpca.alignment.pose_error import CORRECT
from gpca.errors import InputError
from gpca.experiments.recovery.cases import register_first, register_misplaced
from gpca.experiments.recovery.episodes import MISPLACED, find_episodes
from gpca.recovery.settings import LoopSettings


def test_failures_have_their_cause_and_are_bounded(situations):
    episodes = find_episodes(situations["failures"], LoopSettings(failures=1, tries=8, cloud_points=400))
    assert [episode.number for episode in episodes] == list(range(len(episodes)))
    for episode in episodes:
        assert episode.failed == (episode.outcomes[()].error > CORRECT)
        assert episode.tries <= 8 * MISPLACED
    kinds = [(episode.situation.cause, episode.failed) for episode in episodes]
    assert len(set(kinds)) == len(kinds)
    assert {failed for _, failed in kinds} == {True, False}


def test_a_bad_pose_is_put_on_the_same_measurement(situations):
    disturbed, clean = situations["failures"].draw("pose", "pose", 0)
    estimated = register_first(clean, 400, LoopSettings().icp)
    others = [situations["failures"].misplaced(clean, number) for number in (1, 2)]
    a, b = (register_misplaced(other, estimated, 400, LoopSettings().icp).holding for other in others)
    assert a.shots is b.shots is estimated.holding.shots
    assert not np.allclose(a.T_world_object_init, b.T_world_object_init)
    assert others[0].cause == disturbed.cause == "pose"


def test_no_failure_at_all_is_one_line(situations, monkeypatch):
    monkeypatch.setattr("gpca.experiments.recovery.episodes.register_first", lambda *given: None)
    with pytest.raises(InputError, match=r"no registration failed \(2 of noise, 2 of pose, 2 of overlap\)"):
        find_episodes(situations["failures"], LoopSettings(tries=2))
