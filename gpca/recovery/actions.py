"""Actions of a robot on a failed registration, by name, and what it can observe without the true pose."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from gpca.alignment.icp import clipped_cost
from gpca.errors import require_known
from gpca.frames.shots import Shot, agreement, fuse
from gpca.rigid import inverse, rigid_motion, rotation_angle_rad, scale_translation
from gpca.settings import require_arguments

if TYPE_CHECKING:
    from gpca.frames.situations import Situation

LOOSER = 2.0  # correspondence distance of the broader search, relative to ICP's
JUDGED = 8  # number of results of the search that are compared with the shots
MODEL_POINTS, CLOUD_POINTS = 512, 256
BEHIND = (0.1, 0.25)  # tried distances of the object's center behind the middle of the measured side, in diameters
AROUND_DEG = (20.0, 45.0, 70.0)  # elevations of the viewpoints around a table
OBSERVED = (
    *("fitness", "inlier_rmse", "to_model_median", "to_model_high", "to_observed_median", "to_observed_high"),
    *("thickness", "on_model", "explained", "hidden", "log_points", "rotation_rad", "translation", "shots", "filtered"),
    *("rival_gain", "rival_distance", "rivals"),
)
FEWEST_POINTS = 64  # with fewer points of the object in all shots there is nothing to register
ELSEWHERE = 0.1  # distance between different poses, in diameters
PROBED = 16  # number of orientations tried to find rivals of a pose


class Robot:
    """A robot in a situation: its camera, and the model of the object."""

    def __init__(self, situation: Situation, axes: tuple = ()) -> None:
        shelf, model = situation.shelf, situation.model
        self.points_m = shelf.objects.points(model)
        self.normals = shelf.objects.normals_of(model)
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


@dataclass(frozen=True)
class Holding:
    """A robot's state in a case."""

    shots: tuple[Shot, ...]  # one per viewpoint
    T_world_object_init: np.ndarray  # initial pose of ICP
    T_world_object: np.ndarray  # and its result
    frames: int = 1  # per viewpoint
    filtered: bool = False  # whether statistical outliers are removed


Action = Callable[..., Holding]
Random = np.random.Generator


def reinitialize(holding: Holding, robot: Robot, random: Random, starts: int = 64, posterior: bool = False) -> Holding:
    """Search all orientations by ICP with a larger reach, perhaps with probable poses; start from the best result."""
    poses = search(holding, robot, random, starts)
    return best_start(holding, robot, [*poses, *(probable(holding, robot, random) if posterior else ())])


def probable(holding: Holding, robot: Robot, random: Random) -> list[np.ndarray]:
    """Return the probable poses of what was measured, whatever its initial pose; none for few points."""
    from gpca.alignment.methods.interface import Pair
    from gpca.reenactment.registration import pose_posterior
    from gpca.reenactment.settings import ReenactmentSettings

    d = robot.diameter_m
    cloud_m = fuse(holding.shots, d, holding.filtered)
    if len(cloud_m) < FEWEST_POINTS:
        return []
    observed = cloud_m[random.permutation(len(cloud_m))[:MODEL_POINTS]] / d
    model = robot.points_m[random.permutation(len(robot.points_m))[: 2 * MODEL_POINTS]].astype(np.float64) / d
    T_start = scale_translation(inverse(holding.T_world_object), 1 / d)
    poses, _ = pose_posterior(Pair(observed, model, T_start), ReenactmentSettings(), prior=False)
    return [inverse(scale_translation(T, d)) for T in poses]


def search(holding: Holding, robot: Robot, random: Random, starts: int) -> list[np.ndarray]:
    """Return the `JUDGED` best results of ICP with a larger reach from random orientations; none for few points."""
    from scipy.spatial.transform import Rotation

    from gpca.alignment.batched_icp import BatchedICP
    from gpca.alignment.icp import ICPSettings

    d = robot.diameter_m
    cloud_m = fuse(holding.shots, d, holding.filtered)
    if len(cloud_m) < 3:
        return []
    thinned_m = cloud_m[random.permutation(len(cloud_m))[:CLOUD_POINTS]]
    model_m = robot.points_m[random.permutation(len(robot.points_m))[:MODEL_POINTS]].astype(np.float64)
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
    holding: Holding, robot: Robot, random: Random, azimuths: int = 8, elevations_deg: tuple[float, ...] = AROUND_DEG
) -> Holding:
    """Move to the viewpoint that should show most of the unseen surface, and fuse its shot."""
    from gpca.frames.shots import best_viewpoint

    poses_n, *surface = look_around(holding, robot, random, azimuths, elevations_deg)
    shot = robot.shoot(poses_n[best_viewpoint(*surface)], holding.frames)
    looked = replace(holding, shots=(*holding.shots, shot))
    return best_start(looked, robot, [robot.estimate(shot, looked.filtered)])


def look_around(
    holding: Holding, robot: Robot, random: Random, azimuths: int = 8, elevations_deg: Sequence[float] = AROUND_DEG
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return viewpoints (n, 4, 4) around the measured points, and which model points were and would be seen."""
    from gpca.frames.shots import candidates, expected_surface
    from gpca.frames.situations import coarse

    center_m = fuse(holding.shots, robot.diameter_m, holding.filtered).mean(axis=0)
    first = holding.shots[0]
    distance_m = float(np.linalg.norm(center_m - first.T_world_camera[:3, 3]))
    poses_n = candidates(center_m, distance_m, azimuths, elevations_deg)
    points_m = robot.points_m[random.permutation(len(robot.points_m))[:MODEL_POINTS]]
    shape, pose = (robot.vertices_m, robot.faces, points_m), (holding.T_world_object, robot.diameter_m)
    return poses_n, *expected_surface(holding.shots, *shape, *pose, poses_n, coarse(first.camera))


def denoise(holding: Holding, robot: Robot, random: Random, frames: int = 10) -> Holding:
    """From now on, take the median of several frames at every viewpoint and remove statistical outliers."""
    if holding.filtered:  # a repeated action adds frames to the earlier ones
        frames += holding.frames
    shots = tuple(robot.shoot(shot.T_world_camera, frames) for shot in holding.shots)
    measured = replace(holding, shots=shots, frames=frames, filtered=True)
    return best_start(measured, robot, [robot.estimate(shot, True) for shot in shots])


def best_start(holding: Holding, robot: Robot, poses: Sequence[np.ndarray | None]) -> Holding:
    cloud_m = fuse(holding.shots, robot.diameter_m, holding.filtered)
    if not len(cloud_m):
        return holding
    candidates = [holding.T_world_object, *(pose for pose in poses if pose is not None)]
    shares = [sum(shares[:2]) for shares in _agreements(holding, robot, cloud_m, candidates)]
    return replace(holding, T_world_object_init=candidates[int(np.argmax(shares))])


ACTIONS: dict[str, Action] = {"reinitialize": reinitialize, "new_view": new_view, "denoise": denoise}


def action_of(name: str, settings: Mapping[str, object]) -> Action:
    require_known("recovery action", name, ACTIONS)
    require_arguments(f"recovery action '{name}'", ACTIONS[name], 3, settings)
    return partial(ACTIONS[name], **settings)


def observe(holding: Holding, record: dict, robot: Robot, random: Random) -> np.ndarray:
    """Return the numbers `OBSERVED` of a registration; lengths are in diameters.

    Distances after ICP are median and 90th percentile; thickness is the measured cloud's, by local planes; on_model,
    explained and hidden are of :func:`gpca.frames.shots.agreement`; rotation and translation are the motion by ICP.
    Rivals are other poses of a short search: gain in agreement of the best, its distance, share of results elsewhere.
    """
    from gpca.alignment.pose_error import adds_error
    from gpca.pairs.distances import LocalPlanes

    d = robot.diameter_m
    cloud, target = (_thinned(record[name].astype(np.float64), MODEL_POINTS) for name in ("cloud", "target"))
    observed, model = LocalPlanes.of(cloud), LocalPlanes.of(target)
    to_model_N, to_observed_M = model.tree.query(cloud)[0], observed.tree.query(target)[0]
    cloud_m = fuse(holding.shots, d, holding.filtered)
    T_moved = inverse(holding.T_world_object_init) @ holding.T_world_object
    rivals = (0.0, 0.0, 0.0)
    poses = search(holding, robot, random, PROBED)
    shares, *others = _agreements(holding, robot, cloud_m, [holding.T_world_object, *poses])
    if poses:
        points_m = _thinned(robot.points_m, CLOUD_POINTS)
        distances = [adds_error(points_m, T, holding.T_world_object) / d for T in poses]
        explained = [sum(each[:2]) for each in others]
        best = int(np.argmax(explained))
        elsewhere = float(np.mean([distance > ELSEWHERE for distance in distances]))
        rivals = explained[best] - sum(shares[:2]), distances[best], elsewhere
    return np.array(
        [
            *(record["fitness"], record["inlier_rmse"]),
            *np.quantile(to_model_N, (0.5, 0.9)),
            *np.quantile(to_observed_M, (0.5, 0.9)),
            *(np.median(observed.thickness), *shares, np.log(len(cloud_m))),
            *(rotation_angle_rad(T_moved), np.linalg.norm(T_moved[:3, 3]) / d),
            *(float(len(holding.shots)), float(holding.filtered)),
            *rivals,
        ]
    )


def _agreements(holding: Holding, robot: Robot, cloud_m: np.ndarray, poses: Sequence[np.ndarray]) -> list[tuple]:
    points_m = _thinned(cloud_m, CLOUD_POINTS)
    model_m, normals = (_thinned(each, MODEL_POINTS).astype(np.float64) for each in (robot.points_m, robot.normals))
    return [agreement(holding.shots, points_m, model_m, normals, T, robot.diameter_m) for T in poses]


def _thinned(points: np.ndarray, count: int) -> np.ndarray:
    return points[:: max(1, len(points) // count)]
