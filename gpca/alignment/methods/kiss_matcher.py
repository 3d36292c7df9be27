"""KISS-Matcher (Lim et al. 2025): features, pruning and a robust solver, by a package that the suite does without."""

from __future__ import annotations

from importlib import import_module

import numpy as np

from gpca.alignment.methods.interface import (
    CORRESPONDENCE_DISTANCE,
    FEWEST,
    FailedRegistration,
    MethodEntry,
    Outcome,
    Pair,
)


def align(pair: Pair, voxel: float = 0.04, correspondence_distance: float = CORRESPONDENCE_DISTANCE) -> Outcome:
    """Match both clouds, thinned to voxels of an edge in diameters, from which all of its radii follow."""
    package = import_module("kiss_matcher")
    try:  # it does not take voxels below 0.005, nor clouds of which too little is left
        matcher = package.KISSMatcher(package.KISSMatcherConfig(voxel))
        found = matcher.estimate(pair.source.astype(np.float32), pair.target.astype(np.float32))
    except RuntimeError as fault:
        raise FailedRegistration(f"KISS-Matcher: {fault}") from fault
    if not found.valid or matcher.get_num_final_inliers() < FEWEST:
        raise FailedRegistration(f"fewer than {FEWEST} correspondences agree")
    T_target_source = np.eye(4)
    T_target_source[:3, :3], T_target_source[:3, 3] = found.rotation, np.ravel(found.translation)
    return Outcome.at(pair, T_target_source, correspondence_distance)


METHODS = {"kiss_matcher": MethodEntry("KISS-Matcher", align, is_global=True, package="kiss_matcher")}
