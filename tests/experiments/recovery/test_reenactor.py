from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gpca.causes.settings import OBSERVED, CauseSettings
from gpca.errors import InputError
from gpca.experiments.recovery.episodes import Episode
from gpca.experiments.recovery.reenactor import Reenactor, calibrated_alarm
from gpca.reenactment.settings import ReenactmentSettings
from tests.failures import LOOP


def reenactor():
    return Reenactor(ReenactmentSettings(), CauseSettings(moved=OBSERVED))


def blanked(episode):
    """The same episode without anything that only the truth tells."""
    situation, start = episode.situation, episode.outcomes[()]
    nowhere = np.full((4, 4), np.nan)
    standing = tuple(replace(object_, T_world_object=nowhere) for object_ in situation.standing)
    situation = replace(situation, standing=standing, T_object_estimated=nowhere, cause="")
    record = start.record | {"T_target_source_true": nowhere, "concept": ""}
    return Episode(1, situation, replace(start, record=record, error=np.nan), LOOP.success)


def test_no_truth_is_read(start):
    episode = Episode(0, *start, LOOP.success)
    seen, blind = (reenactor().reenact(e) for e in (episode, blanked(episode)))
    assert seen.belief.failure == blind.belief.failure
    assert np.array_equal(seen.phi_3, blind.phi_3)


def test_a_registration_is_re_enacted_once(start):
    episode, twice = Episode(0, *start, LOOP.success), reenactor()
    assert twice.reenact(episode) is twice.reenact(episode)
    assert twice.reenact(episode).belief is twice.believe(episode)


class Believing:
    """Takes every episode for failed with the probability that it has by itself."""

    def believe(self, episode):
        return SimpleNamespace(failure=episode.failure)


def test_the_alarm_is_set_on_the_good_ones():
    good = [SimpleNamespace(failed=False, failure=n / 100) for n in range(1, 20)]
    failed = [SimpleNamespace(failed=True, failure=0.9)] * 30
    assert calibrated_alarm([*good, *failed], Believing(), 0.05) == 0.19
    assert calibrated_alarm([*good, *failed], Believing(), 0.5) == 0.10
    with pytest.raises(InputError, match="has no good registration by which the alarm"):
        calibrated_alarm(failed, Believing(), 0.05)
