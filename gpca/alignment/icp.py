"""Point cloud registration by ICP (Besl & McKay 1992; Chen & Medioni 1992; Segal et al. 2009) through Open3D."""

from dataclasses import dataclass
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np

from gpca.errors import InputError
from gpca.process.environment import open3d_cloud, require_open3d
from gpca.settings import Bounds, Count

Method = Literal["point_to_point", "point_to_plane", "generalized"]
CONVERGED = 1e-6  # largest change of fitness and of inlier RMSE in the last iteration; Open3D's default


@dataclass(frozen=True)
class ICPSettings:
    """Settings of ICP; it stops before `max_iterations` when fitness and RMSE change by less than 1e-6."""

    method: Method = "point_to_point"
    correspondence_distance: Annotated[float, Bounds(exclusiveMinimum=0, maximum=10)] = 0.10  # diameters
    max_iterations: Count = 50


class Registration(NamedTuple):
    """The result of ICP: pose (4×4), share of source points with a correspondence, RMSE over those."""

    T_target_source: np.ndarray
    fitness: float
    inlier_rmse: float


class ICP:
    """Open3D's ICP to one target (P, 3), in any unit, perhaps with a robust kernel; planes need normals (P, 3)."""

    def __init__(
        self, target: np.ndarray, target_normals: np.ndarray | None, settings: ICPSettings, kernel: Any = None
    ) -> None:
        self._settings = settings
        self._target = open3d_cloud(target, target_normals)
        registration = self._registration = require_open3d().pipelines.registration
        self._estimation = {
            "point_to_point": registration.TransformationEstimationPointToPoint,
            "point_to_plane": registration.TransformationEstimationPointToPlane,
            "generalized": registration.TransformationEstimationForGeneralizedICP,
        }[settings.method](*([] if kernel is None else [kernel]))
        self._criteria = registration.ICPConvergenceCriteria(max_iteration=settings.max_iterations)

    def register(self, source: np.ndarray, T_target_source_init: np.ndarray) -> Registration:
        """Align `source` (P, 3) from the initial pose; fewer than three points or NaN raise an InputError."""
        require_cloud("source cloud", source)
        generalized = self._settings.method == "generalized"
        align = self._registration.registration_generalized_icp if generalized else self._registration.registration_icp
        distance, start = self._settings.correspondence_distance, T_target_source_init
        result = align(open3d_cloud(source), self._target, distance, start, self._estimation, self._criteria)
        return Registration(np.array(result.transformation), result.fitness, result.inlier_rmse)


def require_cloud(name: str, points: np.ndarray) -> None:
    if len(points) < 3 or not np.isfinite(points).all():
        raise InputError(name, f"has {len(points)} points or contains NaN", "give at least 3 finite points")


def clipped_cost(fitness_n: np.ndarray, inlier_rmse_n: np.ndarray, distance: float) -> np.ndarray:
    """Mean squared distance (n,) of the source's points, clipped at the correspondence distance."""
    return fitness_n * inlier_rmse_n**2 + (1 - fitness_n) * distance**2
