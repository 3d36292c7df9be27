"""Numbers that a robot can measure without the truth: distances, agreement with the shots, the motion of ICP."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gpca.alignment.pose_error import adds_error
from gpca.alignment.rigid import inverse, rotation_angle_rad
from gpca.frames.shots import agreement, fuse
from gpca.pairs.distances import LocalPlanes
from gpca.recovery.actions import CLOUD_POINTS, MODEL_POINTS, Holding, Robot, search

OBSERVED = (
    *("fitness", "inlier_rmse", "to_model_median", "to_model_high", "to_observed_median", "to_observed_high"),
    *("thickness", "on_model", "explained", "hidden", "log_points", "rotation_rad", "translation", "shots", "filtered"),
    *("rival_gain", "rival_distance", "rivals"),
)
ELSEWHERE = 0.1  # diameters; a rival farther off than this is another pose, and no variant of the same
PROBED = 16  # so many orientations are tried to find rivals of a pose


def observe(holding: Holding, record: dict, robot: Robot, random: np.random.Generator) -> np.ndarray:
    """Return the numbers `OBSERVED` of a registration; lengths are in diameters.

    The distances are those of the pair after ICP, both ways: their median and 90th percentile. Thickness is the
    measured cloud's own, by local planes; on_model, explained and hidden are those of
    :func:`gpca.frames.shots.agreement`. Rotation and translation are how far ICP moved the model from its start.
    Rivals are other poses, found by a short search (:func:`_rivals`).

    Args:
        record: the registration's row, see :func:`gpca.pairs.synthesis.align_pair`.
        random: draws the orientations that the search starts from.
    """
    d = robot.diameter_m
    cloud, target = (_thinned(record[name].astype(np.float64), MODEL_POINTS) for name in ("cloud", "target"))
    observed, model = LocalPlanes.of(cloud), LocalPlanes.of(target)
    to_model_N, to_observed_M = model.tree.query(cloud)[0], observed.tree.query(target)[0]
    cloud_m = fuse(holding.shots, d, holding.filtered)
    model_m, normals = (_thinned(array, MODEL_POINTS).astype(np.float64) for array in (robot.points_m, robot.normals))
    shots_m = (holding.shots, _thinned(cloud_m, CLOUD_POINTS), model_m, normals)
    shares = agreement(*shots_m, holding.T_world_object, d)
    T_moved = inverse(holding.T_world_object_init) @ holding.T_world_object
    return np.array(
        [
            *(record["fitness"], record["inlier_rmse"]),
            *np.quantile(to_model_N, (0.5, 0.9)),
            *np.quantile(to_observed_M, (0.5, 0.9)),
            *(np.median(observed.thickness), *shares, np.log(len(cloud_m))),
            *(rotation_angle_rad(T_moved), np.linalg.norm(T_moved[:3, 3]) / d),
            *(float(len(holding.shots)), float(holding.filtered)),
            *_rivals(holding, robot, random, lambda T: sum(agreement(*shots_m, T, d)[:2])),
        ]
    )


def _rivals(
    holding: Holding, robot: Robot, random: np.random.Generator, explained: Callable[[np.ndarray], float]
) -> tuple[float, float, float]:
    """Return how much better the best rival explains the shots, how far it is, and which share of all is elsewhere.

    A right pose is found again from other orientations, a wrong one loses to what is found.
    """
    poses = search(holding, robot, random, PROBED)
    if not poses:
        return 0.0, 0.0, 0.0
    points_m = _thinned(robot.points_m, CLOUD_POINTS)
    distances = [adds_error(points_m, T, holding.T_world_object) / robot.diameter_m for T in poses]
    best = int(np.argmax(worth := [explained(T) for T in poses]))
    elsewhere = np.mean([distance > ELSEWHERE for distance in distances])
    return worth[best] - explained(holding.T_world_object), distances[best], float(elsewhere)


def _thinned(points: np.ndarray, count: int) -> np.ndarray:
    return points[:: max(1, len(points) // count)]
