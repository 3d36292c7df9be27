import pytest

from gpca.alignment.pose_error import CORRECT
from gpca.errors import InputError
from gpca.recovery.episodes import find_failures
from gpca.recovery.settings import LoopSettings


def test_failures_have_their_cause_and_are_bounded(situations):
    episodes = find_failures(situations["failures"], LoopSettings(failures=1, tries=8, cloud_points=400))
    for episode in episodes:
        assert episode.outcomes[()].error > CORRECT
        assert episode.tries <= 8
    causes = [episode.situation.cause for episode in episodes]
    assert len(set(causes)) == len(causes)


def test_no_failure_at_all_is_one_line(situations, monkeypatch):
    monkeypatch.setattr("gpca.recovery.episodes.register_first", lambda *given: None)
    with pytest.raises(InputError, match=r"no registration failed \(2 of noise, 2 of pose, 2 of overlap\)"):
        find_failures(situations["failures"], LoopSettings(tries=2))
