"""Episodes: failures of a known cause, and everything that is tried about each.

A failure is a registration whose pose is wrong (ADD, or ADD-S of symmetric objects, above 10 % of the diameter) and
whose cause is known: without it, the same registration succeeds. An action gives the same result whichever policy
takes it after the same actions, so what was tried once is kept.
"""

from __future__ import annotations

from collections.abc import Mapping

from gpca.alignment.pose_error import CORRECT
from gpca.errors import InputError
from gpca.frames.situations import Situation, Situations
from gpca.pairs.perturbation import CONCEPTS
from gpca.progress import progress
from gpca.recovery.actions import Action
from gpca.recovery.cases import Attempt, register_after, register_first
from gpca.recovery.settings import LoopSettings


class Episode:
    """A failure and everything that was tried about it.

    Args:
        number: its own among all of a run.
        tries: registrations that were made for all failures of its cause.
    """

    def __init__(self, number: int, situation: Situation, start: Attempt, tries: int) -> None:
        self.number = number
        self.situation = situation
        self.tries = tries
        self.outcomes: dict[tuple[str, ...], Attempt] = {(): start}

    def take(self, actions: tuple[str, ...], known: Mapping[str, Action], settings: LoopSettings) -> Attempt:
        """Return the outcome after these actions, of which all but the last were taken."""
        if actions not in self.outcomes:
            before = self.outcomes[actions[:-1]]
            action = known[actions[-1]]
            outcome = register_after(self.situation, before, action, actions, settings.cloud_points, settings.icp)
            self.outcomes[actions] = outcome
        return self.outcomes[actions]


def find_failures(situations: Situations, settings: LoopSettings) -> list[Episode]:
    """Draw situations of every cause until enough of their registrations have failed for it.

    Raises:
        InputError: no failure at all.
    """
    episodes: list[Episode] = []
    tried: dict[str, int] = {}
    for cause in CONCEPTS:
        found: list[tuple[Situation, Attempt]] = []
        for number in progress(range(settings.tries), f"failures by {cause}"):
            if len(found) == settings.failures:
                break
            tried[cause] = number + 1
            disturbed, clean = situations.draw(cause, cause, number)
            start = register_first(disturbed, settings.cloud_points, settings.icp)
            if start is None or start.error <= CORRECT:
                continue
            without = register_first(clean, settings.cloud_points, settings.icp)
            if without is not None and without.error <= CORRECT:
                found.append((disturbed, start))
        episodes += [
            Episode(len(episodes) + n, situation, start, tried[cause]) for n, (situation, start) in enumerate(found)
        ]
    if not episodes:
        counts = ", ".join(f"{n} of {cause}" for cause, n in tried.items())
        raise InputError("recovery", f"no registration failed ({counts})", "raise recovery.tries or the disturbances")
    return episodes
