import numpy as np
import pytest

from gpca.errors import InputError
from gpca.experiments.recovery.cases import register_first, register_misplaced
from gpca.experiments.recovery.episodes import MISPLACED, _try_situation, find_episodes
from gpca.recovery.settings import LoopSettings


def test_failures_have_their_cause_and_are_bounded(situations):
    settings = LoopSettings(failures=1, good=1, tries=8, cloud_points=400)
    episodes = find_episodes(situations["failures"], settings)
    assert [episode.number for episode in episodes] == list(range(len(episodes)))
    for episode in episodes:
        assert episode.failed == (episode.outcomes[()].error >= settings.success)
        assert episode.tries <= 8 * MISPLACED
    failures = [episode.situation.cause for episode in episodes if episode.failed]
    assert len(set(failures)) == len(failures)
    assert 0 < sum(not episode.failed for episode in episodes) <= 3


def test_a_failure_is_right_without_its_cause_and_that_registration_is_a_good_one(situations):
    settings = LoopSettings(failures=1, good=1, tries=8, cloud_points=400)
    failure, good, _ = next(
        found
        for number in range(40)
        if (found := _try_situation(situations["failures"], "overlap", number, settings, 1))[0]
    )
    assert (failure[0].cause, good[0].cause) == ("overlap", "")
    assert failure[1].error >= settings.success > good[1].error
    assert failure[0].axes == good[0].axes
    assert failure[0].table == good[0].table


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
