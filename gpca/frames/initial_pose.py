"""The pose that ICP starts from in a frame: an estimator's results, the truth with a declared error, or features.

All return ``T_camera_object``, in meters, with the object's frame at the center of its bounding box.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from gpca.alignment.rigid import inverse, random_direction, rigid_motion, rotate, transform
from gpca.errors import InputError
from gpca.pairs.perturbation import HalfTurn, Shift
from gpca.process.environment import open3d_cloud, require_open3d
from gpca.settings import Count, PositiveShare

Form = Literal["results", "true_pose", "global_registration"]
FORMS = get_args(Form)


@dataclass(frozen=True)
class InitialPoseSettings:
    """Where initial poses come from.

    Attributes:
        form: ``results`` of an estimator, ``true_pose`` with an error, or ``global_registration``.
        rotation_deg, translation: largest error of ``true_pose``, the angle and in diameters, drawn uniformly.
        voxel: the size at which ``global_registration`` computes features, in diameters.
        tries: random starts of RANSAC, of which the best is taken.
    """

    form: Form = "global_registration"
    rotation_deg: HalfTurn = 5.0
    translation: Shift = 0.03
    voxel: PositiveShare = 0.05
    tries: Count = 20

    def __post_init__(self) -> None:
        if self.form not in FORMS:
            raise InputError(f"initial pose '{self.form}'", "unknown", f"choose one of {', '.join(FORMS)}")


def displace(T_camera_object: np.ndarray, diameter_m: float, settings: InitialPoseSettings, random) -> np.ndarray:
    """Return the true pose with a random error of at most the declared size."""
    turn = Rotation.from_rotvec(np.deg2rad(random.uniform(0, settings.rotation_deg)) * random_direction(random))
    shift_m = random.uniform(0, settings.translation) * diameter_m * random_direction(random)
    return T_camera_object @ rigid_motion(turn.as_matrix(), shift_m)


class GlobalRegistration:
    """FPFH features and RANSAC (Rusu et al. 2009; Zhou et al. 2018) through Open3D, the best of several runs.

    A run is judged after point-to-plane ICP from its pose by the share of measured points that lie on the model and
    the share of the model's points facing the camera that were measured: many poses explain the points, but few
    also what should be seen. Needs no truth; a stand-in for a pose estimator.

    Args:
        model: canonical points (Q, 3) of the object and their normals, in meters.
    """

    def __init__(self, points_m: np.ndarray, normals: np.ndarray, diameter_m: float, settings: InitialPoseSettings):
        self._o3d = require_open3d()
        self._settings = settings
        self._voxel_m = settings.voxel * diameter_m
        self._model = self._features(open3d_cloud(points_m, normals))

    def register(self, points_m: np.ndarray, seed: int) -> np.ndarray:
        """Return ``T_camera_object`` of the measured points (P, 3), which are in the camera's frame.

        The same seed gives the same pose where Open3D runs on one thread (``OMP_NUM_THREADS=1``).
        """
        o3d = self._o3d
        registration = o3d.pipelines.registration
        cloud = open3d_cloud(points_m)
        cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(radius=2 * self._voxel_m, max_nn=30))
        cloud.orient_normals_towards_camera_location(np.zeros(3))
        (source, source_features), (model, model_features) = self._features(cloud), self._model
        reach_m = 1.5 * self._voxel_m
        tree = cKDTree(source.points)
        model_m = np.asarray(model.points)
        normals = np.asarray(model.normals)
        best, best_share = np.eye(4), -1.0
        for number in range(self._settings.tries):
            o3d.utility.random.seed((seed + number) % 2**31)
            coarse = registration.registration_ransac_based_on_feature_matching(
                source,
                model,
                source_features,
                model_features,
                mutual_filter=False,
                max_correspondence_distance=reach_m,
                estimation_method=registration.TransformationEstimationPointToPoint(),
                ransac_n=3,
                checkers=[
                    registration.CorrespondenceCheckerBasedOnEdgeLength(0.9),
                    registration.CorrespondenceCheckerBasedOnDistance(reach_m),
                    registration.CorrespondenceCheckerBasedOnNormal(np.deg2rad(60)),
                ],
                criteria=registration.RANSACConvergenceCriteria(4000, 0.999),
            )
            fine = registration.registration_icp(
                source,
                model,
                reach_m,
                coarse.transformation,
                registration.TransformationEstimationPointToPlane(),
                registration.ICPConvergenceCriteria(max_iteration=20),
            )
            T_camera_object = inverse(np.array(fine.transformation))
            seen_m = transform(T_camera_object, model_m)
            facing = np.sum(seen_m * rotate(T_camera_object, normals), axis=1) < 0
            share = fine.fitness + np.sum(tree.query(seen_m[facing])[0] < self._voxel_m) / max(1, facing.sum())
            if share > best_share:
                best, best_share = T_camera_object, share
        return best

    def _features(self, cloud):
        thinned = cloud.voxel_down_sample(self._voxel_m)
        search = self._o3d.geometry.KDTreeSearchParamHybrid(radius=5 * self._voxel_m, max_nn=100)
        return thinned, self._o3d.pipelines.registration.compute_fpfh_feature(thinned, search)
