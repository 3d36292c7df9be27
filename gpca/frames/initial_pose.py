"""Initial poses of ICP in frames: results of pose estimators, the truth with a declared error, or features."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from gpca.errors import InputError, refusing
from gpca.io.csv_file import ANY, numbers, read_csv
from gpca.numerals import decimal, whole
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.perturbation import HalfTurn, Shift
from gpca.process.environment import open3d_cloud, require_open3d
from gpca.rigid import inverse, random_direction, require_rotation, rigid_motion, rotate, transform
from gpca.settings import Count, PositiveShare

RESULT_COLUMNS = ("scene_id", "im_id", "obj_id", "score", "R", "t")
REMEDY = "export it again"
# Limits of the distance from the camera, relative to that of the objects annotated in the image, for any one pose and
# for half of the poses of a file. Poses in centimeters would be off by 10.
ONE_OFF, HALF_OFF = 100.0, 3.0

PosesByObject = Mapping[tuple[int, int, int], list[np.ndarray]]
ERROR_COLUMNS = ("obj_id", "rx", "ry", "rz", "tx", "ty", "tz")
FARTHEST_MM = 1e4  # no estimator is off by more


def read_bop_results(
    path: str | Path, distances_m: Mapping[tuple[int, int], Sequence[float]], ids: Collection[int]
) -> PosesByObject:
    """Return the poses ``T_camera_model`` of a BOP results file by (scene, image, object id), the best first."""
    rows = read_csv(path, RESULT_COLUMNS, others=ANY, remedy=REMEDY)
    scored_poses: dict[tuple[int, int, int], list[tuple[float, np.ndarray]]] = {}
    ratios = []
    for line, row in enumerate(rows.to_dict("records"), start=2):
        subject, key = f"{path}: line {line}", []
        for column in ("scene_id", "im_id", "obj_id"):
            with refusing(subject, f"{column} is {row[column][:40]!r}, not a whole number", REMEDY):
                key.append(whole(row[column].strip()))
        scene, image, number = key
        if (scene, image) not in distances_m:
            raise InputError(subject, f"the dataset has no image {image} of scene {scene}", "check results or split")
        if number not in ids:
            raise InputError(subject, f"the dataset has no object {number}", "check results, or fetch the models again")
        entries = {}
        for column, count in (("score", 1), ("R", 9), ("t", 3)):
            with refusing(subject, f"{column} contains values that are not finite numbers: {{}}", REMEDY):
                entries[column] = np.array([decimal(text) for text in row[column].replace(",", " ").split()])
            if (given := len(entries[column])) != count:
                raise InputError(subject, f"{column} has {given} entries, not {count}", "separate them by spaces")
            if not (abs(entries[column]) < 1e100).all():  # no norm of these overflows
                raise InputError(subject, f"{column} contains a number that is out of bounds", REMEDY)
        pose = rigid_motion(entries["R"].reshape(3, 3), entries["t"] / 1000)
        require_rotation(pose, subject)
        if pose[2, 3] <= 0:
            fault = f"t has z = {1e3 * pose[2, 3]:.6g} mm, not in front of the camera"
            raise InputError(subject, fault, "leave out failed estimates")
        if annotated := distances_m[scene, image]:
            ratios.append(float(np.linalg.norm(pose[:3, 3]) / np.median(annotated)))
            _require_unit(subject, ratios[-1], ONE_OFF)
        scored_poses.setdefault((scene, image, number), []).append((float(entries["score"][0]), pose))
    if ratios:
        _require_unit(path, float(np.median(ratios)), HALF_OFF)
    return {key: [T for _, T in sorted(poses, key=lambda pose: -pose[0])] for key, poses in scored_poses.items()}


def _require_unit(subject: object, ratio: float, most: float) -> None:
    if not 1 / most <= ratio <= most:
        fault = f"t is {ratio:.2g} times as long as that of the objects annotated in the image"
        raise InputError(subject, fault, "give it in millimeters")


def estimates_of(
    poses_by_estimator: Mapping[str, PosesByObject], place: tuple[int, int, int], alone: bool, seen: Mapping
) -> list[tuple[str, np.ndarray]]:
    """Return name and pose ``T_camera_model`` of each estimator that found an object (scene, image, id)."""
    estimates = []
    for name in sorted(poses_by_estimator):
        if poses := poses_by_estimator[name].get(place):
            # The pose whose origin is seen nearest to the mask's center: several equal objects may be in sight.
            shown = [seen["camera_3_3"] @ pose[:3, 3] for pose in poses]
            center_2 = seen["pixels"].mean(axis=0)
            pose = poses[int(np.argmin([np.linalg.norm(p[:2] / p[2] - center_2) for p in shown]))]
            away_m = np.linalg.norm(pose[:3, 3] - np.median(seen["points_m"], axis=0))
            if alone or away_m <= seen["diameter_m"]:
                estimates.append((name, pose))
    return estimates


@dataclass
class EstimatorErrors:
    """Errors ``T_true_estimated`` (m) by dataset and object id; `symmetric` ones, which contain turns, are not lent."""

    symmetric: Collection[tuple[str, int]]
    by_object: dict[tuple[str, int], list[np.ndarray]] = field(default_factory=dict)

    @classmethod
    def read(
        cls, files: Mapping[str, tuple[Path | None, Collection[int]]], symmetric: Collection[tuple[str, int]]
    ) -> EstimatorErrors:
        """Return the errors in the file of each dataset that has one, of the objects with these ids."""
        errors = cls(symmetric)
        for name, (path, ids) in files.items():
            for number, T_error in read_pose_errors(path, ids) if path else ():
                errors.add((name, number), T_error)
        return errors

    def add(self, object_: tuple[str, int], T_true_estimated: np.ndarray) -> None:
        """Add an error that an estimator made on an object."""
        self.by_object.setdefault(object_, []).append(T_true_estimated)

    def draw(self, object_: tuple[str, int], random: np.random.Generator) -> np.ndarray:
        """Return one error of this object, else of any without symmetry; InputError where there is none."""
        others = (errors for each, errors in self.by_object.items() if each not in self.symmetric)
        errors = self.by_object.get(object_) or [T for errors in others for T in errors]
        if not errors:
            fault = "no estimator has a result for an object without symmetry"
            raise InputError("real_world.datasets", fault, "name more results, or a file of errors")
        return errors[int(random.integers(len(errors)))]


def read_pose_errors(path: Path, listed: Collection[int]) -> list[tuple[int, np.ndarray]]:
    """Return each row of a CSV with a listed `obj_id`: rotation vector `rx,ry,rz` (rad), shift `tx,ty,tz` (mm)."""
    rows = read_csv(path, ERROR_COLUMNS, others=ANY)
    values_N_7 = np.stack([numbers(path, rows, name) for name in ERROR_COLUMNS], axis=1)
    ids, turns_N_3, shifts_N_3 = np.split(values_N_7, (1, 4), axis=1)
    if (ids != np.round(ids)).any() or (ids < 0).any():
        raise InputError(path, "column 'obj_id' contains values that are not whole numbers", "regenerate it")
    if np.linalg.norm(turns_N_3, axis=1).max() > np.pi + 1e-3:
        raise InputError(path, "contains a rotation of more than half a turn", "give rotation vectors in radians")
    if np.linalg.norm(shifts_N_3, axis=1).max() > FARTHEST_MM:
        raise InputError(path, "contains an error of more than 10 m", "give translations in millimeters")
    motions = rigid_motion(Rotation.from_rotvec(turns_N_3).as_matrix(), shifts_N_3 / 1000)
    return [(int(number), T) for number, T in zip(ids[:, 0], motions, strict=True) if int(number) in listed]


Form = Literal["results", "true_pose", "global_registration"]


@dataclass(frozen=True)
class InitialPoseSettings:
    """Where poses come from: ``results`` of an estimator, ``true_pose`` with an error, or ``global_registration``."""

    form: Form = "global_registration"
    rotation_deg: HalfTurn = 5.0  # largest error of `true_pose`, drawn uniformly
    translation: Shift = 0.03  # the same, in diameters
    voxel: PositiveShare = 0.05  # of the features of `global_registration`, in diameters
    tries: Count = 20  # random starts of RANSAC, of which the best is taken


def displace(T_camera_object: np.ndarray, diameter_m: float, settings: InitialPoseSettings, random) -> np.ndarray:
    """Return the true pose with a random error of at most the declared size."""
    turn = Rotation.from_rotvec(np.deg2rad(random.uniform(0, settings.rotation_deg)) * random_direction(random))
    shift_m = random.uniform(0, settings.translation) * diameter_m * random_direction(random)
    return T_camera_object @ rigid_motion(turn.as_matrix(), shift_m)


class GlobalRegistration:
    """FPFH and RANSAC (Rusu et al. 2009; Zhou et al. 2018) through Open3D: a stand-in for an estimator."""

    def __init__(self, objects: ObjectClouds, index: int, settings: InitialPoseSettings) -> None:
        self._o3d, self._settings = require_open3d(), settings
        self._voxel_m = settings.voxel * float(objects.diameters_m[index])
        self._model = self._features(open3d_cloud(objects.points(index), objects.normals_of(index)))

    def register(self, points_m: np.ndarray, seed: int) -> np.ndarray:
        """Return ``T_camera_object`` of points (P, 3) in the camera's frame, repeatable where Open3D has one thread."""
        o3d, cloud = self._o3d, open3d_cloud(points_m)
        registration = o3d.pipelines.registration
        cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(radius=2 * self._voxel_m, max_nn=30))
        cloud.orient_normals_towards_camera_location(np.zeros(3))
        (source, source_features), (model, model_features) = self._features(cloud), self._model
        reach_m = 1.5 * self._voxel_m
        checkers = [
            registration.CorrespondenceCheckerBasedOnEdgeLength(0.9),
            registration.CorrespondenceCheckerBasedOnDistance(reach_m),
            registration.CorrespondenceCheckerBasedOnNormal(np.deg2rad(60)),
        ]
        tree, model_m, normals = cKDTree(source.points), np.asarray(model.points), np.asarray(model.normals)
        to_points = registration.TransformationEstimationPointToPoint()
        to_planes = registration.TransformationEstimationPointToPlane()
        last_sample = registration.RANSACConvergenceCriteria(4000, 0.999)
        last_step = registration.ICPConvergenceCriteria(max_iteration=20)
        best, best_share = np.eye(4), -1.0
        for number in range(self._settings.tries):
            o3d.utility.random.seed((seed + number) % 2**31)
            coarse = registration.registration_ransac_based_on_feature_matching(
                source, model, source_features, model_features, False, reach_m, to_points, 3, checkers, last_sample
            )
            fine = registration.registration_icp(source, model, reach_m, coarse.transformation, to_planes, last_step)
            T_camera_object = inverse(np.array(fine.transformation))
            seen_m = transform(T_camera_object, model_m)
            facing = np.sum(seen_m * rotate(T_camera_object, normals), axis=1) < 0
            share = fine.fitness + np.sum(tree.query(seen_m[facing])[0] < self._voxel_m) / max(1, facing.sum())
            if share > best_share:  # of points on the model, and of those that face the camera and were measured
                best, best_share = T_camera_object, share
        return best

    def _features(self, cloud):
        thinned = cloud.voxel_down_sample(self._voxel_m)
        search = self._o3d.geometry.KDTreeSearchParamHybrid(radius=5 * self._voxel_m, max_nn=100)
        return thinned, self._o3d.pipelines.registration.compute_fpfh_feature(thinned, search)
