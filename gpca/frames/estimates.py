"""Results of pose estimators: initial poses, and errors for objects that no estimator found.

A pose error is ``T_true_estimated`` in the frame of the object's model: what takes the true pose to the estimated one.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from gpca.alignment.rigid import inverse, rigid_motion
from gpca.errors import InputError
from gpca.frames.results_file import PosesByObject, nearest_to
from gpca.io.csv_file import ANY, numbers, read_csv

COLUMNS = ("obj_id", "rx", "ry", "rz", "tx", "ty", "tz")
FARTHEST_MM = 1e4  # no estimator is off by more


def choose_estimate(
    poses_by_estimator: Mapping[str, PosesByObject],
    place: tuple[int, int, int],
    alone: bool,
    seen: Mapping,
    random: np.random.Generator,
) -> tuple[str, np.ndarray] | None:
    """Return one estimator that found an object and its pose ``T_camera_model``, drawn of all that did.

    Args:
        poses_by_estimator: of one dataset.
        place: scene, image, object id.
        alone: no other object of this id is in the image. Else an estimate that lies farther than a diameter from what
            was measured is of another one.
        seen: ``points_m`` (P, 3) in the camera's frame, ``pixels`` (P, 2), ``camera_3_3`` and ``diameter_m``.
    """
    candidates = []
    for name in sorted(poses_by_estimator):
        if poses := poses_by_estimator[name].get(place):
            pose = nearest_to(poses, seen["pixels"], seen["camera_3_3"])
            away_m = np.linalg.norm(pose[:3, 3] - np.median(seen["points_m"], axis=0))
            if alone or away_m <= seen["diameter_m"]:
                candidates.append((name, pose))
    return candidates[int(random.integers(len(candidates)))] if candidates else None


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
    rows = read_csv(path, COLUMNS, others=ANY)
    columns = {name: numbers(path, rows, name).to_numpy() for name in COLUMNS}
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
