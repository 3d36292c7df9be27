"""Registrations disturbed by a known cause, failed or fine, and every outcome of what is tried about each."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from gpca.alignment.pose_error import JUDGED_POINTS, pose_error
from gpca.errors import InputError
from gpca.frames.shots import fuse
from gpca.frames.situations import Situation, Situations
from gpca.pairs.perturbation import CONCEPTS, Perturbed
from gpca.pairs.synthesis import align_pair
from gpca.process.progress import progress
from gpca.recovery.actions import FEWEST_POINTS, Action, Holding, Robot, observe
from gpca.recovery.settings import LoopSettings
from gpca.rigid import inverse, scale_translation, transform
from gpca.seeds import generator

POSE = "pose"  # the cause that disturbs nothing but ICP's start
MISPLACED = 40  # its starts that are tried in a situation until one fails; in every other one, only the first


@dataclass(frozen=True)
class Attempt:
    """A registration: the robot's data, the columns of its row, the truth about it."""

    holding: Holding  # with the pose that ICP ended at
    record: dict  # of :func:`gpca.pairs.synthesis.align_pair`, which lacks sample and split
    error: float  # ADD, or ADD-S of symmetric objects, relative to the diameter; never shown to a policy
    seconds: float  # of ICP and of the action before it, without the camera


def register_first(situation: Situation, settings: LoopSettings) -> Attempt | None:
    """Estimate the pose from the first shot and register; None where it shows too little of the object."""
    robot = Robot(situation)
    shot = robot.shoot(situation.T_world_camera, 1)
    started = perf_counter()
    T_init = robot.estimate(shot, False)
    if T_init is None:
        return None
    seconds = perf_counter() - started
    outcome = register_held(situation, Holding((shot,), T_init, T_init), settings)
    return outcome and replace(outcome, seconds=seconds + outcome.seconds)


def register_misplaced(situation: Situation, clean: Attempt, settings: LoopSettings) -> Attempt:
    """Register the measurement made without a pose error, from the estimate that has the situation's error."""
    T_init = clean.holding.T_world_object_init @ situation.T_object_estimated
    attempt = register_held(situation, Holding(clean.holding.shots, T_init, T_init), settings)
    assert attempt is not None  # the same points were registered before
    return attempt


def register_after(
    situation: Situation, before: Attempt, action: Action, actions: tuple[str, ...], settings: LoopSettings
) -> Attempt:
    """Take one action, named last of all that were taken, which name the random numbers, and register anew."""
    robot = Robot(situation, actions)
    started = perf_counter()
    holding = action(before.holding, robot, generator(*situation.axes, "action", *actions))
    seconds = perf_counter() - started - robot.camera_seconds
    outcome = register_held(situation, holding, settings, actions)
    if outcome is None:  # filtering left too little: the robot keeps what it had
        return replace(before, seconds=seconds)
    return replace(outcome, seconds=seconds + outcome.seconds)


def register_held(
    situation: Situation, holding: Holding, settings: LoopSettings, actions: tuple[str, ...] = ()
) -> Attempt | None:
    started, points = perf_counter(), settings.cloud_points
    objects, model, d = situation.shelf.objects, situation.model, situation.diameter_m
    cloud_m = fuse(holding.shots, d, holding.filtered)
    if len(cloud_m) < FEWEST_POINTS:
        return None
    random = generator(*situation.axes, "points", *actions)
    source_m = cloud_m[random.permutation(len(cloud_m))[:points]]
    target_rows = generator(*situation.axes, "target").permutation(len(objects.points(model)))[:points]
    T_init, T_true = holding.T_world_object_init, situation.T_world_object
    T_target_source_true = scale_translation(inverse(T_true) @ T_init, 1 / d)
    perturbed = Perturbed(transform(inverse(T_init), source_m) / d, T_target_source_true)
    record = align_pair(perturbed, objects, model, target_rows, settings.icp)
    T_world_object = T_init @ inverse(record["T_target_source_icp"])
    error = pose_error(objects.points(model)[:JUDGED_POINTS], T_world_object, T_true, situation.shelf.symmetric[model])
    ended, record = replace(holding, T_world_object=T_world_object), record | {"concept": situation.cause}
    return Attempt(ended, record, error / d, perf_counter() - started)


Started = tuple[Situation, Attempt]


class Episode:
    """A registration and everything that was tried about it; wrong from an error of `success` diameters on."""

    def __init__(self, number: int, situation: Situation, start: Attempt, success: float, tries: int = 1) -> None:
        self.number, self.situation, self.tries = number, situation, tries
        self._success = success
        self.outcomes: dict[tuple[str, ...], Attempt] = {(): start}
        self._observed: dict[tuple[str, ...], np.ndarray] = {}

    @property
    def failed(self) -> bool:
        """Whether there is anything to recover."""
        return not self.is_right()

    def is_right(self, actions: tuple[str, ...] = ()) -> bool:
        """Whether the pose is right after these actions, which were taken."""
        return is_right(self.outcomes[actions], self._success)

    def observe(self, actions: tuple[str, ...]) -> np.ndarray:
        """What the robot observes after these actions, see :func:`gpca.recovery.actions.observe`."""
        if actions not in self._observed:
            attempt = self.outcomes[actions]
            random = generator(*self.situation.axes, "observe", *actions)
            self._observed[actions] = observe(attempt.holding, attempt.record, Robot(self.situation), random)
        return self._observed[actions]

    def solved_by(self, actions: tuple[str, ...], by_name: Mapping[str, Action], settings: LoopSettings) -> bool:
        """Whether the pose is right after these actions, of which all but the last were taken."""
        return is_right(self.take(actions, by_name, settings), self._success)

    def take(self, actions: tuple[str, ...], by_name: Mapping[str, Action], settings: LoopSettings) -> Attempt:
        """The outcome after these actions, of which all but the last were taken."""
        if actions not in self.outcomes:
            before, action = self.outcomes[actions[:-1]], by_name[actions[-1]]
            self.outcomes[actions] = register_after(self.situation, before, action, actions, settings)
        return self.outcomes[actions]


def is_right(attempt: Attempt | None, success: float) -> bool:
    return attempt is not None and attempt.error < success


def find_episodes(situations: Situations, settings: LoopSettings) -> list[Episode]:
    """Draw situations until enough registrations failed by each cause, which come first, and enough are good."""
    episodes: list[Episode] = []
    tries: dict[str, int] = {}
    for cause in CONCEPTS:
        failures: list[Started] = []
        good: list[Started] = []
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
) -> tuple[Started | None, Started | None, int]:
    """Return the failure by the cause, a good registration, each None where there is none, and how many were made."""
    disturbed, clean = situations.draw(cause, cause, number)
    start: Attempt | None = None
    if cause != POSE:
        start = register_first(disturbed, settings)
        if start is None:
            return None, None, 1
        if is_right(start, settings.success):
            return None, (disturbed, start), 1
    without = register_first(clean, settings)
    if without is None or not is_right(without, settings.success):
        return None, None, 1
    if start is not None:
        return (disturbed, start), (clean, without), 1
    for tried in range(1, misplaced + 1):
        situation = situations.misplaced(clean, tried)
        attempt = register_misplaced(situation, without, settings)
        if not is_right(attempt, settings.success):
            return (situation, attempt), (clean, without), tried
    return None, (situation, attempt), misplaced
