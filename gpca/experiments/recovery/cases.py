"""Cases: registrations of one situation, from the first one on through whatever actions were taken."""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.alignment.pose_error import JUDGED_POINTS, pose_error
from gpca.alignment.rigid import inverse, scale_translation, transform
from gpca.frames.shots import Shot, fuse
from gpca.frames.situations import Situation
from gpca.pairs.perturbation import Perturbed
from gpca.pairs.synthesis import align_pair
from gpca.recovery.actions import Action, Holding
from gpca.seeds import generator

FEWEST_POINTS = 64  # with fewer points of the object in all shots there is nothing to register


@dataclass(frozen=True)
class Attempt:
    """A registration: the robot's data, the columns of its row, the truth about it.

    Attributes:
        holding: the robot's measurements, with the pose that ICP ended at.
        record: what :func:`gpca.pairs.synthesis.align_pair` returns, which lacks sample and split.
        error: ADD, or ADD-S of symmetric objects, relative to the diameter. Never shown to a policy.
        seconds: the time of ICP and of the action before it, without the camera.
    """

    holding: Holding
    record: dict
    error: float
    seconds: float


class RobotIn:
    """A robot in a situation: its camera, and the model of the object."""

    def __init__(self, situation: Situation, axes: tuple = ()) -> None:
        shelf, model = situation.shelf, situation.model
        self.points_m = shelf.objects.points(model)
        self.normals = shelf.objects.normals(model)
        self.vertices_m = shelf.surfaces[model].vertices_m
        self.faces = shelf.surfaces[model].triangles
        self.diameter_m = situation.diameter_m
        self.camera_seconds = 0.0
        self._situation = situation
        self._axes = axes

    def shoot(self, T_world_camera: np.ndarray, frames: int) -> Shot:
        """Measure from a viewpoint; the noise is named by the actions before and by the viewpoint."""
        started = perf_counter()
        shot = self._situation.shoot(T_world_camera, frames, *self._axes, T_world_camera.round(6).tolist())
        self.camera_seconds += perf_counter() - started
        return shot

    def estimate(self, shot: Shot, filtered: bool) -> np.ndarray | None:
        """Estimate the pose from one shot; None where it shows too little."""
        points_m = fuse((shot,), self.diameter_m, filtered)
        if len(points_m) < FEWEST_POINTS:
            return None
        return self._situation.estimate(shot, points_m, *self._axes, shot.T_world_camera.round(6).tolist())


def register_first(situation: Situation, points: int, icp: ICPSettings) -> Attempt | None:
    """Estimate the pose from the first shot and register; None where it shows too little of the object."""
    robot = RobotIn(situation)
    shot = robot.shoot(situation.T_world_camera, 1)
    started = perf_counter()
    T_init = robot.estimate(shot, False)
    if T_init is None:
        return None
    seconds = perf_counter() - started
    outcome = register_held(situation, Holding((shot,), T_init, T_init), points, icp)
    return outcome and replace(outcome, seconds=seconds + outcome.seconds)


def register_misplaced(situation: Situation, clean: Attempt, points: int, icp: ICPSettings) -> Attempt | None:
    """Register the measurement made without a pose error, from the estimate that has the situation's error."""
    T_init = clean.holding.T_world_object_init @ situation.T_object_estimated
    return register_held(situation, Holding(clean.holding.shots, T_init, T_init), points, icp)


def register_after(
    situation: Situation, before: Attempt, action: Action, actions: tuple[str, ...], points: int, icp: ICPSettings
) -> Attempt:
    """Take one action and register anew.

    Args:
        actions: names of all that were taken, this one included; they name the random numbers.
    """
    robot = RobotIn(situation, actions)
    started = perf_counter()
    holding = action(before.holding, robot, generator(*situation.axes, "action", *actions))
    seconds = perf_counter() - started - robot.camera_seconds
    outcome = register_held(situation, holding, points, icp, actions)
    if outcome is None:  # filtering left too little: the robot keeps what it had
        return replace(before, seconds=seconds)
    return replace(outcome, seconds=seconds + outcome.seconds)


def register_held(
    situation: Situation, holding: Holding, points: int, icp: ICPSettings, actions: tuple[str, ...] = ()
) -> Attempt | None:
    """Align the object's fused points to its model by ICP, from the initial pose."""
    started = perf_counter()
    objects = situation.shelf.objects
    model = situation.model
    d = situation.diameter_m
    cloud_m = fuse(holding.shots, d, holding.filtered)
    if len(cloud_m) < FEWEST_POINTS:
        return None
    random = generator(*situation.axes, "points", *actions)
    source_m = cloud_m[random.permutation(len(cloud_m))[:points]]
    target_rows = generator(*situation.axes, "target").permutation(len(objects.points(model)))[:points]
    T_init, T_true = holding.T_world_object_init, situation.T_world_object
    perturbed = Perturbed(
        transform(inverse(T_init), source_m) / d,
        T_target_source_true=scale_translation(inverse(T_true) @ T_init, 1 / d),
    )
    record = align_pair(perturbed, objects, model, target_rows, icp)
    T_world_object = T_init @ inverse(record["T_target_source_icp"])
    error = pose_error(objects.points(model)[:JUDGED_POINTS], T_world_object, T_true, situation.shelf.symmetric[model])
    return Attempt(
        replace(holding, T_world_object=T_world_object),
        record | {"concept": situation.cause},
        error / d,
        perf_counter() - started,
    )
