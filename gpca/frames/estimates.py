"""Results of pose estimators: initial poses, and errors for objects that no estimator found.

A results file is one of the BOP benchmark: https://github.com/thodan/bop_toolkit, "Evaluating your method",
`scene_id,im_id,obj_id,score,R,t,time`. A pose error is ``T_true_estimated`` in the frame of the object's model: what
takes the true pose to the estimated one.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from gpca.alignment.rigid import inverse, require_rotation, rigid_motion
from gpca.errors import InputError
from gpca.io.csv_file import ANY, numbers, read_csv
from gpca.numerals import decimal, whole

RESULT_COLUMNS = ("scene_id", "im_id", "obj_id", "score", "R", "t")
REMEDY = "export it again"
# A pose's distance from the camera, relative to that of the objects annotated in its image: no single estimate is off
# by more than this, however bad ...
ONE_OFF = 100.0
# ... and half of a file's are not off by more than this, unless the unit is wrong: centimeters would be by 10.
HALF_OFF = 3.0
UNIT_OFF = 0.3  # of a tenfold: so near to a power of ten the unit is told by it

PosesByObject = Mapping[tuple[int, int, int], list[np.ndarray]]
ERROR_COLUMNS = ("obj_id", "rx", "ry", "rz", "tx", "ty", "tz")
FARTHEST_MM = 1e4  # no estimator is off by more


def read_bop_results(
    path: str | Path, distances_m: Mapping[tuple[int, int], Sequence[float]], known: Collection[int]
) -> PosesByObject:
    """Read a results file, as every method for the benchmark exports it.

    Args:
        distances_m: (scene, image) of the dataset -> how far its annotated objects are from the camera.
        known: ids of the dataset's objects.

    Returns:
        (scene, image, object id) -> poses ``T_camera_model`` in meters, the highest score first.

    Raises:
        InputError: missing file or column, R without nine numbers or t without three, R that is no rotation, a number
            that is none, an image or object that the dataset does not have, a pose behind the camera, translations in
            another unit than millimeters.
    """
    rows = read_csv(path, RESULT_COLUMNS, others=ANY, remedy=REMEDY)
    scored_poses: dict[tuple[int, int, int], list[tuple[float, np.ndarray]]] = {}
    ratios = []
    for number, row in enumerate(rows.to_dict("records"), start=2):
        subject = f"{path}: line {number}"
        key = (_id(subject, row, "scene_id"), _id(subject, row, "im_id"), _id(subject, row, "obj_id"))
        if key[:2] not in distances_m:
            raise InputError(subject, f"the dataset has no image {key[1]} of scene {key[0]}", "check results or split")
        if key[2] not in known:
            raise InputError(subject, f"the dataset has no object {key[2]}", "check results, or fetch the models again")
        (score,) = _entries(subject, row, "score", 1)
        pose = _pose(subject, row)
        if annotated := distances_m[key[:2]]:
            ratios.append(float(np.linalg.norm(pose[:3, 3]) / np.median(annotated)))
            _require_unit(subject, ratios[-1], ONE_OFF)
        scored_poses.setdefault(key, []).append((score, pose))
    if ratios:
        _require_unit(path, float(np.median(ratios)), HALF_OFF)
    return {key: [T for _, T in sorted(poses, key=lambda pose: -pose[0])] for key, poses in scored_poses.items()}


def nearest_to(poses: list[np.ndarray], pixels_P_2: np.ndarray, camera_3_3: np.ndarray) -> np.ndarray:
    """Return the pose whose origin is seen nearest to the mask's center, as several equal objects may be in sight."""
    center_2 = pixels_P_2.mean(axis=0)
    seen = [camera_3_3 @ pose[:3, 3] for pose in poses]
    return poses[int(np.argmin([np.linalg.norm(p[:2] / p[2] - center_2) for p in seen]))]


def _id(subject: str, row: dict, column: str) -> int:
    text = str(row[column]).strip()
    try:
        return whole(text)
    except ValueError as fault:
        raise InputError(subject, f"{column} is {text[:40]!r}, not a whole number", REMEDY) from fault


def _pose(subject: str, row: dict) -> np.ndarray:
    R_camera_model = _entries(subject, row, "R", 9).reshape(3, 3)
    T_camera_model = rigid_motion(R_camera_model, _entries(subject, row, "t", 3) / 1000)
    require_rotation(T_camera_model, subject)
    if T_camera_model[2, 3] <= 0:
        raise InputError(
            subject,
            f"t has z = {1e3 * T_camera_model[2, 3]:.6g} mm, not in front of the camera",
            "leave out failed estimates",
        )
    return T_camera_model


def _entries(subject: str, row: dict, column: str, count: int) -> np.ndarray:
    try:
        numbers = np.array([decimal(text) for text in str(row[column]).replace(",", " ").split()])
    except ValueError as fault:
        raise InputError(subject, f"{column} contains values that are not finite numbers: {fault}", REMEDY) from fault
    if len(numbers) != count:
        raise InputError(subject, f"{column} has {len(numbers)} entries, not {count}", "separate them by spaces")
    if not (abs(numbers) < 1e100).all():  # no norm of these overflows
        raise InputError(subject, f"{column} contains a number that is out of bounds", REMEDY)
    return numbers


def _require_unit(subject: object, ratio: float, most: float) -> None:
    if 1 / most <= ratio <= most:
        return
    tenfold = float(np.log10(max(ratio, 1e-9)))
    nearest = round(tenfold) if abs(tenfold - round(tenfold)) < UNIT_OFF else 0
    unit = {-3: "in meters", -1: "in centimeters", 3: "in micrometers"}.get(nearest, "in another unit")
    raise InputError(
        subject,
        f"t is {ratio:.2g} times as long as that of the objects annotated in the image",
        f"is t {unit}? the format requires millimeters",
    )


def estimates_of(
    poses_by_estimator: Mapping[str, PosesByObject], place: tuple[int, int, int], alone: bool, seen: Mapping
) -> list[tuple[str, np.ndarray]]:
    """Return every estimator that found an object, by name, and its pose ``T_camera_model``.

    Args:
        poses_by_estimator: of one dataset.
        place: scene, image, object id.
        alone: no other object of this id is in the image. Else an estimate that lies farther than a diameter from what
            was measured is of another one.
        seen: ``points_m`` (P, 3) in the camera's frame, ``pixels`` (P, 2), ``camera_3_3`` and ``diameter_m``.
    """
    estimates = []
    for name in sorted(poses_by_estimator):
        if poses := poses_by_estimator[name].get(place):
            pose = nearest_to(poses, seen["pixels"], seen["camera_3_3"])
            away_m = np.linalg.norm(pose[:3, 3] - np.median(seen["points_m"], axis=0))
            if alone or away_m <= seen["diameter_m"]:
                estimates.append((name, pose))
    return estimates


@dataclass
class EstimatorErrors:
    """Errors that estimators made, by dataset and object id; objects without any get those of others.

    Attributes:
        of_object: (dataset, object id) -> errors ``T_true_estimated`` (4, 4), meters.
        symmetric: objects whose errors are no measure of another's: a turn that changes nothing about them counts.
    """

    symmetric: Collection[tuple[str, int]]
    of_object: dict[tuple[str, int], list[np.ndarray]] = field(default_factory=dict)

    def add(self, object_: tuple[str, int], T_true_estimated: np.ndarray) -> None:
        """Add an error that an estimator made on an object."""
        self.of_object.setdefault(object_, []).append(T_true_estimated)

    def draw(self, object_: tuple[str, int], random: np.random.Generator) -> np.ndarray:
        """Return one error of this object, or, where there is none, of any object without symmetry.

        Raises:
            InputError: no estimator ever erred on one.
        """
        errors = self.of_object.get(object_) or self._of_others()
        if not errors:
            fault = "no estimator has a result for an object without symmetry"
            raise InputError("real_world.datasets", fault, "name more results, or a file of errors")
        return errors[int(random.integers(len(errors)))]

    def _of_others(self) -> list[np.ndarray]:
        return [T for object_, errors in self.of_object.items() if object_ not in self.symmetric for T in errors]


def error_of(T_camera_true: np.ndarray, T_camera_estimated: np.ndarray) -> np.ndarray:
    """Return ``T_true_estimated`` of two poses of one model."""
    return inverse(T_camera_true) @ T_camera_estimated


def read_pose_errors(path: Path, known: Iterable[int]) -> list[tuple[int, np.ndarray]]:
    """Read a CSV of errors: `obj_id`, rotation vector `rx,ry,rz` in radians, translation `tx,ty,tz` in millimeters.

    Args:
        known: ids of the dataset's objects; rows of others are passed over.

    Raises:
        InputError: missing file or column, an entry that is no finite number, an id that is none, a rotation beyond
            half a turn, a translation that no estimator is off by.
    """
    rows = read_csv(path, ERROR_COLUMNS, others=ANY)
    columns = {name: numbers(path, rows, name).to_numpy() for name in ERROR_COLUMNS}
    ids = columns["obj_id"]
    if (ids != np.round(ids)).any() or (ids < 0).any():
        raise InputError(path, "column 'obj_id' contains values that are not whole numbers", "regenerate it")
    turns_N_3 = np.stack([columns[name] for name in ("rx", "ry", "rz")], axis=1)
    shifts_N_3 = np.stack([columns[name] for name in ("tx", "ty", "tz")], axis=1)
    if np.linalg.norm(turns_N_3, axis=1).max() > np.pi + 1e-3:
        raise InputError(path, "contains a rotation of more than half a turn", "give rotation vectors in radians")
    if np.linalg.norm(shifts_N_3, axis=1).max() > FARTHEST_MM:
        raise InputError(path, "contains an error of more than 10 m", "give translations in millimeters")
    motions = rigid_motion(Rotation.from_rotvec(turns_N_3).as_matrix(), shifts_N_3 / 1000)
    known = set(known)
    return [(int(number), T) for number, T in zip(ids, motions, strict=True) if int(number) in known]
