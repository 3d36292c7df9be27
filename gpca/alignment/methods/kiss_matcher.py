"""KISS-Matcher (Lim et al. 2025): features, pruning and a robust solver, by an optional package."""

from __future__ import annotations

import os
from functools import cache
from importlib import import_module
from typing import Any

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
from gpca.alignment.rigid import rigid_motion

VOXEL = 0.08  # diameters; on a development seed the best for some 500 points (0.05 for 2000)
# Somewhat more than the package needs: three neighbors within three voxels at each remaining point.
NEAR, NEIGHBORS, FEATURES = 2.0, 4, 10


def align(pair: Pair, voxel: float = VOXEL, correspondence_distance: float = CORRESPONDENCE_DISTANCE) -> Outcome:
    """Match both clouds, thinned to voxels in diameters, which also determine all radii."""
    package = _in_one_thread(import_module("kiss_matcher"))
    for name in ("source", "target"):
        if not _has_features(getattr(pair, name), voxel):
            raise FailedRegistration(f"of the {name}, voxels of {voxel:g} diameters leave too few points")
    try:  # it rejects voxels below 0.005, and clouds with too few remaining points
        matcher = package.KISSMatcher(package.KISSMatcherConfig(voxel))
        result = matcher.estimate(pair.source.astype(np.float32), pair.target.astype(np.float32))
    except RuntimeError as fault:
        raise FailedRegistration(f"KISS-Matcher: {fault}") from fault
    if not result.valid or matcher.get_num_final_inliers() < FEWEST:
        raise FailedRegistration(f"fewer than {FEWEST} correspondences agree")
    T_target_source = rigid_motion(result.rotation, np.ravel(result.translation))
    return Outcome.at(pair, T_target_source, correspondence_distance)


@cache
def _in_one_thread(package: Any) -> Any:
    """Return the package limited to one thread: several threads race, and change a pose now and then.

    TBB has no variable for its threads; at its first call it starts one for each processor of the process.
    """
    process = os.getpid()
    allowed = os.sched_getaffinity(process)
    cube_N_3 = np.indices((6, 6, 6)).reshape(3, -1).T.astype(np.float32)
    os.sched_setaffinity(process, {min(allowed)})
    try:
        package.KISSMatcher(package.KISSMatcherConfig(1.0)).estimate(cube_N_3, cube_N_3)
    finally:
        os.sched_setaffinity(process, allowed)
    return package


def _has_features(points_N_3: np.ndarray, voxel: float) -> bool:
    """Return whether enough points have enough neighbors for a normal: without any, the package ends the process."""
    voxels_M_3 = np.unique(np.floor(points_N_3 / max(voxel, 1e-6)), axis=0)
    neighbors_M = cKDTree(voxels_M_3).query_ball_point(voxels_M_3, NEAR, return_length=True)
    return int((neighbors_M > NEIGHBORS).sum()) >= FEATURES


METHODS = {"kiss_matcher": MethodEntry("KISS-Matcher", align, is_global=True, package="kiss_matcher")}
