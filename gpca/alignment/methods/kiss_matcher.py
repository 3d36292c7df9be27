"""KISS-Matcher (Lim et al. 2025): features, pruning and a robust solver, by an optional package."""

from __future__ import annotations

from importlib import import_module

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.methods.interface import (
    CORRESPONDENCE_DISTANCE,
    FEWEST,
    FailedRegistration,
    MethodEntry,
    Outcome,
    Pair,
)
from gpca.alignment.rigid import rigid_motion, rotate

# Diameters. On a development seed, the best of 0.02 to 0.13 for clouds of some 500 points; for 2000 it is 0.05.
VOXEL = 0.08
SOLVER_SHARE = 0.75  # of the noise that the package's pruning allows, its solver allows so much
# Somewhat more than the package needs: it looks for three neighbors within three voxels, at each of the points left.
NEAR, NEIGHBORS, FEATURES = 2.0, 4, 10


def align(
    pair: Pair,
    voxel: float = VOXEL,
    correspondence_distance: float = CORRESPONDENCE_DISTANCE,
    centered: bool = False,
    normal_gain: float = 3.0,
    feature_gain: float = 5.0,
    noise_gain: float = 1.0,
) -> Outcome:
    """Match both clouds, thinned to voxels of an edge in diameters, from which all of its radii follow.

    Args:
        voxel: edge of the voxels, in diameters.
        centered: whether each cloud is moved to its own center first. The package turns normals to the origin, where
            its authors' sensors stand; the center of an object is the same side of all of its surface.
        normal_gain, feature_gain, noise_gain: radii of normals and features, and how far a right match may be off, in
            voxels; those of the package.
    """
    package = import_module("kiss_matcher")
    for name in ("source", "target"):
        if not _has_features(getattr(pair, name), voxel):
            raise FailedRegistration(f"of the {name}, voxels of {voxel:g} diameters leave too few points")
    origins_2_3 = [points.mean(axis=0) if centered else np.zeros(3) for points in (pair.source, pair.target)]
    gains = {"normal_r_gain": normal_gain, "fpfh_r_gain": feature_gain}
    gains |= {"robin_noise_bound_gain": noise_gain, "solver_noise_bound_gain": SOLVER_SHARE * noise_gain}
    try:  # it does not take voxels below 0.005, nor clouds of which too little is left
        matcher = package.KISSMatcher(package.KISSMatcherConfig(voxel, **gains))
        clouds = [points - origin for points, origin in zip((pair.source, pair.target), origins_2_3, strict=True)]
        result = matcher.estimate(*(cloud.astype(np.float32) for cloud in clouds))
    except RuntimeError as fault:
        raise FailedRegistration(f"KISS-Matcher: {fault}") from fault
    if not result.valid or matcher.get_num_final_inliers() < FEWEST:
        raise FailedRegistration(f"fewer than {FEWEST} correspondences agree")
    source_3, target_3 = origins_2_3
    shift_3 = np.ravel(result.translation) + target_3 - rotate(np.asarray(result.rotation), source_3)
    T_target_source = rigid_motion(result.rotation, shift_3)
    return Outcome.at(pair, T_target_source, correspondence_distance)


def _has_features(points_N_3: np.ndarray, voxel: float) -> bool:
    """Return whether enough points have neighbors enough for a normal: with none the package ends the process."""
    voxels_M_3 = np.unique(np.floor(points_N_3 / max(voxel, 1e-6)), axis=0)
    neighbors_M = cKDTree(voxels_M_3).query_ball_point(voxels_M_3, NEAR, return_length=True)
    return int((neighbors_M > NEIGHBORS).sum()) >= FEATURES


METHODS = {"kiss_matcher": MethodEntry("KISS-Matcher", align, is_global=True, package="kiss_matcher")}
