"""Episodes: registrations disturbed by a known cause, failed or fine, and everything that is tried about each.

A failure is a registration whose pose is wrong (ADD, or ADD-S of symmetric objects, above 10 % of the diameter) and
whose cause is known: without it, the same registration succeeds. An action gives the same result whichever policy
takes it after the same actions, so every outcome is kept.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gpca.alignment.pose_error import CORRECT
from gpca.errors import InputError
from gpca.experiments.recovery.cases import Attempt, RobotIn, register_after, register_first, register_misplaced
from gpca.frames.situations import Situation, Situations
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.recovery.actions import Action
from gpca.recovery.observation import observe
from gpca.recovery.settings import LoopSettings
from gpca.seeds import generator

POSE = "pose"  # the cause that disturbs nothing but ICP's start
MISPLACED = 40  # its starts that are tried in a situation until one fails; in every other one, only the first


class Episode:
    """A registration that failed, or one that did not, and everything that was tried about it.

    Args:
        number: its own among all of a run.
        tries: registrations that were made for all failures of its cause.
    """

    def __init__(self, number: int, situation: Situation, start: Attempt, tries: int) -> None:
        self.number = number
        self.situation = situation
        self.tries = tries
        self.outcomes: dict[tuple[str, ...], Attempt] = {(): start}
        self._observed: dict[tuple[str, ...], np.ndarray] = {}

    @property
    def failed(self) -> bool:
        """Whether there is anything to recover."""
        return not is_right(self.outcomes[()])

    def observe(self, actions: tuple[str, ...]) -> np.ndarray:
        """Return what the robot observes after these actions, see :func:`gpca.recovery.observation.observe`."""
        if actions not in self._observed:
            attempt = self.outcomes[actions]
            random = generator(*self.situation.axes, "observe", *actions)
            self._observed[actions] = observe(attempt.holding, attempt.record, RobotIn(self.situation), random)
        return self._observed[actions]

    def take(self, actions: tuple[str, ...], known: Mapping[str, Action], settings: LoopSettings) -> Attempt:
        """Return the outcome after these actions, of which all but the last were taken."""
        if actions not in self.outcomes:
            before = self.outcomes[actions[:-1]]
            action = known[actions[-1]]
            outcome = register_after(self.situation, before, action, actions, settings.cloud_points, settings.icp)
            self.outcomes[actions] = outcome
        return self.outcomes[actions]


def is_right(attempt: Attempt | None) -> bool:
    """Return whether there is a pose, and a right one."""
    return attempt is not None and attempt.error <= CORRECT


def find_episodes(situations: Situations, settings: LoopSettings) -> list[Episode]:
    """Draw situations of every cause until enough of their registrations have failed for it.

    Of those that did not fail, as many are kept at most. The failures of a cause come first, and each situation gives
    one episode.

    Raises:
        InputError: no failure at all.
    """
    episodes: list[Episode] = []
    tries: dict[str, int] = {}
    for cause in CONCEPTS:
        cases: dict[bool, list[tuple[Situation, Attempt]]] = {True: [], False: []}
        tries[cause] = 0
        for number in progress(range(settings.tries), f"failures by {cause}"):
            if len(cases[True]) == settings.failures:
                break
            misplaced = 1 if number % 2 and len(cases[False]) < settings.failures else MISPLACED
            case, tried = _try_situation(situations, cause, number, settings, misplaced)
            tries[cause] += tried
            if case and len(of_kind := cases[not is_right(case[1])]) < settings.failures:
                of_kind.append(case)
        for situation, start in (*cases[True], *cases[False]):
            episodes.append(Episode(len(episodes), situation, start, tries[cause]))
    if not any(episode.failed for episode in episodes):
        counts = ", ".join(f"{n} of {cause}" for cause, n in tries.items())
        raise InputError("recovery", f"no registration failed ({counts})", "raise recovery.tries or the disturbances")
    return episodes


def _try_situation(
    situations: Situations, cause: str, number: int, settings: LoopSettings, misplaced: int
) -> tuple[tuple[Situation, Attempt] | None, int]:
    """Register a disturbed situation, and the clean one where that failed; of bad poses, until one fails.

    A pose error changes nothing but ICP's start, so several are tried on the same measurement and the same estimate.

    Args:
        misplaced: how many of these, at most.

    Returns:
        the situation with its registration, or None where that failed without the cause too; how many were made.
    """
    points, icp = settings.cloud_points, settings.icp
    disturbed, clean = situations.draw(cause, cause, number)
    if cause != POSE:
        start = register_first(disturbed, points, icp)
        if start is None or not (is_right(start) or is_right(register_first(clean, points, icp))):
            return None, 1
        return (disturbed, start), 1
    estimated = register_first(clean, points, icp)
    if estimated is None or not is_right(estimated):
        return None, 1
    tried = 0
    while True:
        tried += 1
        situation = situations.misplaced(clean, tried)
        attempt = register_misplaced(situation, estimated, points, icp)
        assert attempt is not None  # the same points were registered before
        if tried == misplaced or not is_right(attempt):
            return (situation, attempt), tried
