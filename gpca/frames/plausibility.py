"""Checks that refuse data where objects were not measured where they are annotated (docs/real_world.md)."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from gpca.errors import InputError
from gpca.rigid import inverse, transform

# Median distance of measured points from the model, in diameters. Of 223 annotated objects of five datasets the worst
# is at 0.034; turned at random, the worst is at 0.298. Objects that are farther away do not fit their poses.
FARTHEST = 0.3
JUDGED_POINTS = 200  # of each object, enough for a median
# Limit for the median object of a dataset: in diameters, or in meters where that is more, since sensor noise does not
# shrink with the object. Of five datasets the worst is at 0.56 of this limit; with all poses 30 mm off or every R the
# identity, the best is at 1.5.
FAR, FAR_M = 0.03, 0.004
REMEDY = (
    "check cam_R_m2c and cam_t_m2c (from model to camera, row by row, millimeters, y down and z forward), cam_K, "
    "depth_scale, masks, and that the models are those that the poses were made for"
)


def spread(points_m: np.ndarray, most: int) -> np.ndarray:
    """Return about this many of the points, evenly spread over their order."""
    return points_m[:: max(1, len(points_m) // most)]


def median_distance(tree: cKDTree, T_camera_object: np.ndarray, points_m: np.ndarray) -> float:
    """Return the median distance, in meters, of measured points (P, 3) from the object's cloud at its pose."""
    return float(np.median(tree.query(transform(inverse(T_camera_object), points_m))[0]))


def require_near(subject: str, distance_m: float, diameter_m: float) -> None:
    """Raise an InputError where half of an object's points were measured far from its pose."""
    if distance_m > FARTHEST * diameter_m:
        lie = f"lie {1e3 * distance_m:.0f} mm or more from the model in the annotated pose"
        fault = f"half of its measured points {lie}, {distance_m / diameter_m:.2g} diameters"
        raise InputError(subject, fault, REMEDY)


def require_fitting(subject: str, distances_m: Sequence[float], diameters_m: Sequence[float]) -> None:
    """Raise an InputError where the median object of a dataset is off; single bad masks do not matter."""
    limits_m = np.maximum(FAR * np.array(diameters_m), FAR_M)
    if len(distances_m) and np.median(distances_m / limits_m) > 1:
        share = 100 * np.median(np.array(distances_m) / diameters_m)
        off = f"{1e3 * np.median(distances_m):.1f} mm ({share:.1f} % of the diameter, at the median)"
        limit = f"above the limit of {100 * FAR:g} % or {1e3 * FAR_M:g} mm, whichever is more"
        raise InputError(subject, f"their points lie {off} from the models in the annotated poses, {limit}", REMEDY)
