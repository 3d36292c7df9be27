"""Episodes: registrations disturbed by a known cause, failed or fine, and everything that is tried about each.

A failure is a registration whose pose is wrong (ADD, or ADD-S of symmetric objects, not below the limit of a success)
and whose cause is known: without it, the same registration succeeds. An action gives the same result whichever policy
takes it after the same actions, so every outcome is kept, and sequences share what their first actions gave.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gpca.errors import InputError
from gpca.experiments.recovery.cases import Attempt, RobotIn, register_after, register_first, register_misplaced
from gpca.frames.situations import Situation, Situations
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.recovery.actions import Action, observe
from gpca.recovery.settings import LoopSettings
from gpca.seeds import generator

POSE = "pose"  # the cause that disturbs nothing but ICP's start
MISPLACED = 40  # its starts that are tried in a situation until one fails; in every other one, only the first
Case = tuple[Situation, Attempt]


class Episode:
    """A registration that failed, or one that did not, and everything that was tried about it.

    Args:
        number: its own among all of a run.
        success: error of the pose from which it is wrong, in diameters.
        tries: registrations that were made for all failures of its cause.
    """

    def __init__(self, number: int, situation: Situation, start: Attempt, success: float, tries: int = 1) -> None:
        self.number = number
        self.situation = situation
        self.tries = tries
        self._success = success
        self.outcomes: dict[tuple[str, ...], Attempt] = {(): start}
        self._observed: dict[tuple[str, ...], np.ndarray] = {}

    @property
    def failed(self) -> bool:
        """Whether there is anything to recover."""
        return not self.is_right()

    def is_right(self, actions: tuple[str, ...] = ()) -> bool:
        """Return whether the pose is right after these actions, which were taken."""
        return is_right(self.outcomes[actions], self._success)

    def observe(self, actions: tuple[str, ...]) -> np.ndarray:
        """Return what the robot observes after these actions, see :func:`gpca.recovery.actions.observe`."""
        if actions not in self._observed:
            attempt = self.outcomes[actions]
            random = generator(*self.situation.axes, "observe", *actions)
            self._observed[actions] = observe(attempt.holding, attempt.record, RobotIn(self.situation), random)
        return self._observed[actions]

    def solved_by(self, actions: tuple[str, ...], known: Mapping[str, Action], settings: LoopSettings) -> bool:
        """Return whether the pose is right after these actions, of which all but the last were taken."""
        self.take(actions, known, settings)
        return self.is_right(actions)

    def take(self, actions: tuple[str, ...], known: Mapping[str, Action], settings: LoopSettings) -> Attempt:
        """Return the outcome after these actions, of which all but the last were taken."""
        if actions not in self.outcomes:
            before = self.outcomes[actions[:-1]]
            action = known[actions[-1]]
            outcome = register_after(self.situation, before, action, actions, settings.cloud_points, settings.icp)
            self.outcomes[actions] = outcome
        return self.outcomes[actions]


def is_right(attempt: Attempt | None, success: float) -> bool:
    """Return whether there is a pose, and a right one."""
    return attempt is not None and attempt.error < success


def find_episodes(situations: Situations, settings: LoopSettings) -> list[Episode]:
    """Draw situations of every cause until enough of their registrations have failed for it, and enough are good.

    Each situation gives one good registration at most: the disturbed one if it is right, or else that without the
    cause. The failures of a cause come first.

    Raises:
        InputError: no failure at all.
    """
    episodes: list[Episode] = []
    tries: dict[str, int] = {}
    for cause in CONCEPTS:
        failures: list[Case] = []
        good: list[Case] = []
        tries[cause] = 0
        for number in progress(range(settings.tries), f"failures by {cause}"):
            if len(failures) == settings.failures and len(good) >= settings.good:
                break
            searching = len(failures) < settings.failures
            misplaced = MISPLACED if searching and not (number % 2 and len(good) < settings.good) else 1
            failure, right, tried = _try_situation(situations, cause, number, settings, misplaced)
            tries[cause] += tried if searching else 0
            failures += [failure] if failure and searching else []
            good += [right] if right and len(good) < settings.good else []
        for situation, start in (*failures, *good):
            episodes.append(Episode(len(episodes), situation, start, settings.success, tries[cause]))
    if not any(episode.failed for episode in episodes):
        counts = ", ".join(f"{n} of {cause}" for cause, n in tries.items())
        raise InputError("recovery", f"no registration failed ({counts})", "raise recovery.tries or the disturbances")
    return episodes


def _try_situation(
    situations: Situations, cause: str, number: int, settings: LoopSettings, misplaced: int
) -> tuple[Case | None, Case | None, int]:
    """Register a disturbed situation, and the clean one where that failed; of bad poses, until one fails.

    A pose error changes nothing but ICP's start, so several are tried on the same measurement and the same estimate.

    Args:
        misplaced: how many of these, at most.

    Returns:
        the failure by the cause, and a good registration, each None where there is none; how many were made.
    """
    points, icp, success = settings.cloud_points, settings.icp, settings.success
    disturbed, clean = situations.draw(cause, cause, number)
    if cause != POSE:
        start = register_first(disturbed, points, icp)
        if start is None:
            return None, None, 1
        if is_right(start, success):
            return None, (disturbed, start), 1
        without = register_first(clean, points, icp)
        if without is None or not is_right(without, success):
            return None, None, 1
        return (disturbed, start), (clean, without), 1
    estimated = register_first(clean, points, icp)
    if estimated is None or not is_right(estimated, success):
        return None, None, 1
    tried = 0
    while True:
        tried += 1
        situation = situations.misplaced(clean, tried)
        attempt = register_misplaced(situation, estimated, points, icp)
        assert attempt is not None  # the same points were registered before
        if not is_right(attempt, success):
            return (situation, attempt), (clean, estimated), tried
        if tried == misplaced:
            return None, (situation, attempt), tried
