"""Re-enactments of episodes: each registration once, whichever policies read it; and the alarm that is set by them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gpca.causes.settings import CauseSettings
from gpca.errors import InputError
from gpca.experiments.recovery.cases import RobotIn
from gpca.experiments.recovery.episodes import Episode
from gpca.process.progress import progress
from gpca.recovery.chances import alarm_threshold
from gpca.recovery.reenactment import Belief, KnownModel, Reenacted, believe, reenact
from gpca.reenactment.settings import ReenactmentSettings
from gpca.seeds import generator

Taken = tuple[str, ...]


class Reenactor:
    """Re-enacts registrations of episodes on the tables of one run, from what their robots hold.

    Args:
        settings: what a robot believes of its starts.
        counterfactuals: how it registers under each hypothesis.
    """

    def __init__(self, settings: ReenactmentSettings, counterfactuals: CauseSettings) -> None:
        self._settings = settings
        self._counterfactuals = counterfactuals
        self._models: dict[int, KnownModel] = {}
        self._beliefs: dict[tuple[Episode, Taken], Belief] = {}
        self._reenacted: dict[tuple[Episode, Taken], Reenacted] = {}

    def believe(self, episode: Episode, actions: Taken = ()) -> Belief:
        """Return the hypotheses after these actions, which were taken."""
        key = episode, actions
        if key not in self._beliefs:
            holding, known = episode.outcomes[actions].holding, self._known(episode)
            axes = _axes(episode, actions)
            self._beliefs[key] = believe(holding, known, self._settings, self._counterfactuals, axes)
        return self._beliefs[key]

    def reenact(self, episode: Episode, actions: Taken = ()) -> Reenacted:
        """Return the counterfactuals of the registration after these actions, which were taken."""
        key = episode, actions
        if key not in self._reenacted:
            belief, holding = self.believe(episode, actions), episode.outcomes[actions].holding
            known, axes = self._known(episode), _axes(episode, actions)
            self._reenacted[key] = reenact(belief, holding, known, self._counterfactuals, axes)
        return self._reenacted[key]

    def _known(self, episode: Episode) -> KnownModel:
        model = episode.situation.model
        if model not in self._models:
            name = episode.situation.shelf.objects.names[model]
            self._models[model] = KnownModel.of(RobotIn(episode.situation), generator("known model", name))
        return self._models[model]


def calibrated_alarm(episodes: Iterable[Episode], reenactor: Reenactor, false_alarms: float) -> float:
    """Return the probability of a failure that a further good registration exceeds with at most this probability.

    It is set on the good ones among these episodes, which were not used for training
    (:func:`gpca.recovery.chances.alarm_threshold`).

    Raises:
        InputError: none of them is good.
    """
    good = [episode for episode in episodes if not episode.failed]
    if not good:
        fault = "has no good registration by which the alarm of the re-enactment can be set"
        raise InputError("recovery", fault, "raise recovery.calibration or recovery.rehearsals")
    failures = [reenactor.believe(episode).failure for episode in progress(good, "good registrations for the alarm")]
    return alarm_threshold(np.array(failures), false_alarms)


def _axes(episode: Episode, actions: Taken) -> tuple:
    return (*episode.situation.axes, "re-enactment", *actions)
