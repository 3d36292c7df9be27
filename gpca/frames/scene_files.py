"""The JSON files of a scene in the layout of the BOP benchmark, held to what a camera and a pose can be.

Format: https://github.com/thodan/bop_toolkit/blob/master/docs/bop_datasets_format.md
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gpca.alignment.rigid import require_rotation, rigid_motion
from gpca.errors import InputError
from gpca.io.structured_text import finite_numbers, read_json
from gpca.numerals import whole

REMEDY = "the folder may be half unpacked: unpack the dataset again"
# Wide of every depth camera there is; what lies between is for the measured points to say.
FOCAL_PX = (1.0, 1e6)
DEPTH_SCALES = (1e-6, 1e6)  # millimeters per unit: from nanometers to kilometers
FARTHEST_MM = 1e6


def read_images(path: Path) -> dict[int, Any]:
    """Return what scene_camera.json or scene_gt.json holds, by the number of the image.

    Raises:
        InputError: what :func:`gpca.io.structured_text.read_json` refuses, a key that is no number, or the same
            number twice.
    """
    images: dict[int, Any] = {}
    for key, entry in read_json(path, "a scene's JSON file", REMEDY).items():
        try:
            image = whole(key)
        except ValueError as fault:
            raise InputError(path, f"its key {key[:40]!r} is not an image number", REMEDY) from fault
        if image in images:
            raise InputError(path, f"image {image} occurs twice", "keep one of the two")
        images[image] = entry
    return images


def read_camera(entry: Any, subject: str) -> tuple[np.ndarray, float]:
    """Return K (3, 3) in pixels and the millimeters per unit of depth; InputError where no camera has such."""
    camera_3_3 = _numbers(entry, "cam_K", 9, subject).reshape(3, 3)
    require_camera(camera_3_3, f"{subject}: cam_K")
    (scale,) = _numbers(entry, "depth_scale", 1, subject)
    if not DEPTH_SCALES[0] <= scale <= DEPTH_SCALES[1]:
        raise InputError(subject, f"depth_scale is {scale:.6g}", "give the millimeters per unit of the depth images")
    return camera_3_3, float(scale)


def require_camera(camera_3_3: np.ndarray, subject: str) -> None:
    """Raise an InputError that names `subject` unless K is upper triangular, with focal lengths that can be."""
    if abs(camera_3_3[[1, 2, 2], [0, 0, 1]]).max() > 1e-6 or abs(camera_3_3[2, 2] - 1) > 1e-6:
        raise InputError(subject, "is not a camera matrix", "give fx s cx, 0 fy cy, 0 0 1, row by row")
    focal_px = np.diag(camera_3_3)[:2]
    if not ((focal_px >= FOCAL_PX[0]) & (focal_px <= FOCAL_PX[1])).all():
        lengths = " and ".join(f"{length:.6g}" for length in focal_px)
        raise InputError(subject, f"has the focal lengths {lengths} px", "they must be positive; check fx and fy")
    if abs(camera_3_3[:2]).max() > FOCAL_PX[1]:
        raise InputError(subject, "has a skew or principal point outside any image", "give them in pixels")


def read_pose(entry: Any, subject: str) -> tuple[int, np.ndarray]:
    """Return an annotation's object id and ``T_camera_model`` in meters; InputError where it can be no pose."""
    R_camera_model = _numbers(entry, "cam_R_m2c", 9, subject).reshape(3, 3)
    translation_mm = _numbers(entry, "cam_t_m2c", 3, subject)
    if abs(translation_mm).max() > FARTHEST_MM:
        raise InputError(subject, f"cam_t_m2c is {abs(translation_mm).max():.3g} mm", "no camera sees that far")
    T_camera_model = rigid_motion(R_camera_model, translation_mm / 1000)
    require_rotation(T_camera_model, subject)
    (object_id,) = _numbers(entry, "obj_id", 1, subject)
    if object_id < 0 or object_id > 999_999 or object_id != int(object_id):  # files of models have six digits
        raise InputError(subject, f"obj_id is {object_id:.6g}", "ids are whole numbers of at most six digits")
    return int(object_id), T_camera_model


def _numbers(entry: Any, key: str, count: int, subject: str) -> np.ndarray:
    if not isinstance(entry, dict) or key not in entry:
        raise InputError(subject, f"has no {key}", REMEDY)
    return finite_numbers(entry[key], count, subject, key, REMEDY)
