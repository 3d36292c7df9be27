"""Results files of the BOP benchmark: the poses that an estimator found, and which of them an object is to start from.

Format: https://github.com/thodan/bop_toolkit, "Evaluating your method": `scene_id,im_id,obj_id,score,R,t,time`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

import numpy as np

from gpca.alignment.rigid import require_rotation, rigid_motion
from gpca.errors import InputError
from gpca.io.csv_file import ANY, read_csv
from gpca.numerals import decimal, whole

COLUMNS = ("scene_id", "im_id", "obj_id", "score", "R", "t")
REMEDY = "export it again"
# A pose's distance from the camera, relative to that of the objects annotated in its image: no single estimate is off
# by more than this, however bad ...
ONE_OFF = 100.0
# ... and half of a file's are not off by more than this, unless the unit is wrong: centimeters would be by 10.
HALF_OFF = 3.0
UNIT_OFF = 0.3  # of a tenfold: so near to a power of ten the unit is told by it

PosesByObject = Mapping[tuple[int, int, int], list[np.ndarray]]


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
    rows = read_csv(path, COLUMNS, others=ANY, remedy=REMEDY)
    found: dict[tuple[int, int, int], list[tuple[float, np.ndarray]]] = {}
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
        found.setdefault(key, []).append((score, pose))
    if ratios:
        _require_unit(path, float(np.median(ratios)), HALF_OFF)
    return {key: [T for _, T in sorted(poses, key=lambda pose: -pose[0])] for key, poses in found.items()}


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
