"""What a robot can tell of its registration without the truth: distances, agreement with the shots, what it did."""

from __future__ import annotations

import numpy as np

from gpca.alignment.rigid import inverse, rotation_angle_rad
from gpca.descriptors.distances import LocalPlanes
from gpca.frames.shots import agreement, fuse
from gpca.recovery.actions import CLOUD_POINTS, MODEL_POINTS, Holding, Robot

OBSERVED = (
    *("fitness", "inlier_rmse", "to_model_median", "to_model_high", "to_observed_median", "to_observed_high"),
    *("thickness", "on_model", "explained", "hidden", "log_points", "rotation_rad", "translation", "shots", "filtered"),
)


def observe(holding: Holding, record: dict, robot: Robot) -> np.ndarray:
    """Return the numbers `OBSERVED` of a registration; lengths are in diameters.

    The distances are those of the pair after ICP, both ways: their median and 90th percentile. Thickness is the
    measured cloud's own, by local planes; on_model, explained and hidden are those of
    :func:`gpca.frames.shots.agreement`. Rotation and translation are how far ICP moved the model from its start.

    Args:
        record: the registration's row, see :func:`gpca.pairs.synthesis.align_pair`.
    """
    d = robot.diameter_m
    cloud, target = (_thinned(record[name].astype(np.float64), MODEL_POINTS) for name in ("cloud", "target"))
    observed, model = LocalPlanes.of(cloud), LocalPlanes.of(target)
    to_model_N, to_observed_M = model.tree.query(cloud)[0], observed.tree.query(target)[0]
    cloud_m = fuse(holding.shots, d, holding.filtered)
    model_m, normals = (_thinned(array, MODEL_POINTS).astype(np.float64) for array in (robot.points_m, robot.normals))
    shares = agreement(holding.shots, _thinned(cloud_m, CLOUD_POINTS), model_m, normals, holding.T_world_object, d)
    T_moved = inverse(holding.T_world_object_init) @ holding.T_world_object
    return np.array(
        [
            *(record["fitness"], record["inlier_rmse"]),
            *np.quantile(to_model_N, (0.5, 0.9)),
            *np.quantile(to_observed_M, (0.5, 0.9)),
            *(np.median(observed.thickness), *shares, np.log(len(cloud_m))),
            *(rotation_angle_rad(T_moved), np.linalg.norm(T_moved[:3, 3]) / d),
            *(float(len(holding.shots)), float(holding.filtered)),
        ]
    )


def _thinned(points: np.ndarray, count: int) -> np.ndarray:
    return points[:: max(1, len(points) // count)]
