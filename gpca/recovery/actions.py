"""Actions of a robot on a failed registration, by name: search more broadly, look again, measure better.

An action takes what the robot has (:class:`Holding`) and what it can do with its camera, and
returns what it has then; the registration is made anew from that. No action is told the true pose.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from gpca.alignment.icp import clipped_cost
from gpca.alignment.rigid import inverse, rigid_motion, scale_translation
from gpca.errors import require_known
from gpca.frames.shots import Shot, agreement, fuse
from gpca.settings import require_arguments

LOOSER = 2.0  # the broader search has so many times ICP's correspondence distance
JUDGED = 8  # so many results of the search are compared with the shots
MODEL_POINTS, CLOUD_POINTS = 512, 256
BEHIND = (0.1, 0.25)  # the center is tried so many diameters behind the middle of the measured side


class Robot(Protocol):
    """The means of an action: the camera, and the known shape of the object."""

    points_m: np.ndarray
    normals: np.ndarray
    vertices_m: np.ndarray
    faces: np.ndarray
    diameter_m: float

    def shoot(self, T_world_camera: np.ndarray, frames: int) -> Shot:
        """Measure from a viewpoint."""

    def estimate(self, shot: Shot, filtered: bool) -> np.ndarray | None:
        """Estimate the pose from one shot; None where it shows too little."""


@dataclass(frozen=True)
class Holding:
    """A robot's state in a case: its shots, its poses and how it measures.

    Attributes:
        shots: one per viewpoint.
        T_world_object_init: the pose that ICP starts from.
        T_world_object: the pose that ICP ended at.
        frames: how many are taken at a viewpoint.
        filtered: whether statistical outliers are removed.
    """

    shots: tuple[Shot, ...]
    T_world_object_init: np.ndarray
    T_world_object: np.ndarray
    frames: int = 1
    filtered: bool = False


Action = Callable[..., Holding]


def reinitialize(holding: Holding, robot: Robot, random: np.random.Generator, starts: int = 64) -> Holding:
    """Search all orientations by ICP with a larger reach, and start from the pose that explains the shots best.

    The results of least cost are judged, see :func:`best_start`.
    """
    return best_start(holding, robot, search(holding, robot, random, starts))


def search(holding: Holding, robot: Robot, random: np.random.Generator, starts: int) -> list[np.ndarray]:
    """Return the `JUDGED` poses ``T_world_object`` of least cost that ICP with a larger reach ends at.

    It starts from the pose held and from random orientations; none is found where there are too few points.
    """
    from scipy.spatial.transform import Rotation

    from gpca.alignment.batched_icp import BatchedICP
    from gpca.alignment.icp import ICPSettings

    d = robot.diameter_m
    cloud_m = fuse(holding.shots, d, holding.filtered)
    if len(cloud_m) < 3:
        return []
    thinned_m = cloud_m[random.permutation(len(cloud_m))[:CLOUD_POINTS]]
    rows = random.permutation(len(robot.points_m))[:MODEL_POINTS]
    model_m = robot.points_m[rows].astype(np.float64)
    settings = ICPSettings()
    icp = BatchedICP(model_m / d, replace(settings, correspondence_distance=LOOSER * settings.correspondence_distance))
    away = cloud_m.mean(axis=0) - holding.shots[0].T_world_camera[:3, 3]
    away /= np.linalg.norm(away)
    centers_n_3_m = cloud_m.mean(axis=0) + np.resize(BEHIND, starts)[:, None] * d * away
    T_world_object_n = rigid_motion(Rotation.random(starts, random_state=random).as_matrix(), centers_n_3_m)
    T_world_object_n[0] = holding.T_world_object
    starts_n = np.array([scale_translation(inverse(T), 1 / d) for T in T_world_object_n])
    poses_n, fitness_n, rmse_n = icp.register(thinned_m / d, starts_n)
    cost_n = clipped_cost(fitness_n, rmse_n, LOOSER * settings.correspondence_distance)
    return [inverse(scale_translation(poses_n[n], d)) for n in np.argsort(cost_n, kind="stable")[:JUDGED]]


def new_view(
    holding: Holding,
    robot: Robot,
    random: np.random.Generator,
    azimuths: int = 8,
    elevations_deg: tuple[float, ...] = (20.0, 45.0, 70.0),
) -> Holding:
    """Move to the viewpoint that should show most of the surface not seen yet, and fuse what it shows."""
    from gpca.frames.shots import best_viewpoint

    poses_n, *surface = look_around(holding, robot, random, azimuths, elevations_deg)
    shot = robot.shoot(poses_n[best_viewpoint(*surface)], holding.frames)
    looked = replace(holding, shots=(*holding.shots, shot))
    return best_start(looked, robot, [robot.estimate(shot, looked.filtered)])


def look_around(
    holding: Holding,
    robot: Robot,
    random: np.random.Generator,
    azimuths: int = 8,
    elevations_deg: Sequence[float] = (20.0, 45.0, 70.0),
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return viewpoints ``T_world_camera`` (n, 4, 4), and which of the model's points were and would be seen.

    The last two are those of :func:`gpca.frames.shots.expected_surface`. The viewpoints surround what was measured,
    since the estimated center may be anywhere.
    """
    from gpca.frames.shots import candidates, expected_surface
    from gpca.frames.situations import coarse

    center_m = fuse(holding.shots, robot.diameter_m, holding.filtered).mean(axis=0)
    first = holding.shots[0]
    distance_m = float(np.linalg.norm(center_m - first.T_world_camera[:3, 3]))
    poses_n = candidates(center_m, distance_m, azimuths, elevations_deg)
    points_m = robot.points_m[random.permutation(len(robot.points_m))[:MODEL_POINTS]]
    seen_Q, shown_n_Q = expected_surface(
        holding.shots,
        robot.vertices_m,
        robot.faces,
        points_m,
        holding.T_world_object,
        robot.diameter_m,
        poses_n,
        coarse(first.camera),
    )
    return poses_n, seen_Q, shown_n_Q


def denoise(holding: Holding, robot: Robot, random: np.random.Generator, frames: int = 10) -> Holding:
    """Take several frames at every viewpoint and take their median, and remove statistical outliers, from now on."""
    if holding.filtered:  # it was taken before, and its frames count too
        frames += holding.frames
    shots = tuple(robot.shoot(shot.T_world_camera, frames) for shot in holding.shots)
    measured = replace(holding, shots=shots, frames=frames, filtered=True)
    return best_start(measured, robot, [robot.estimate(shot, True) for shot in shots])


def best_start(holding: Holding, robot: Robot, poses: Sequence[np.ndarray | None]) -> Holding:
    """Start from the pose that explains the shots best: one of these, or the estimate so far.

    Poses are compared by :func:`gpca.frames.shots.agreement`, which needs no truth.
    """
    d = robot.diameter_m
    step = max(1, len(robot.points_m) // MODEL_POINTS)
    cloud_m = fuse(holding.shots, d, holding.filtered)
    cloud_m = cloud_m[:: max(1, len(cloud_m) // CLOUD_POINTS)]
    if not len(cloud_m):
        return holding
    model_m = robot.points_m[::step].astype(np.float64)
    normals = robot.normals[::step]
    known = [holding.T_world_object, *(pose for pose in poses if pose is not None)]
    shares = [sum(agreement(holding.shots, cloud_m, model_m, normals, T, d)[:2]) for T in known]
    return replace(holding, T_world_object_init=known[int(np.argmax(shares))])


ACTIONS: dict[str, Action] = {"reinitialize": reinitialize, "new_view": new_view, "denoise": denoise}


def action_of(name: str, settings: Mapping[str, object]) -> Action:
    """Return the action of that name with its settings; InputError for an unknown name or setting."""
    from functools import partial

    require_known("recovery action", name, ACTIONS)
    require_arguments(f"recovery action '{name}'", ACTIONS[name], 3, settings)
    return partial(ACTIONS[name], **settings)
