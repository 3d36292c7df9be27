"""Fast global registration (Zhou et al. 2016) over matches of FPFH features, by Open3D."""

from __future__ import annotations

import numpy as np

from gpca.alignment.features import MOST_NEIGHBORS, RADIUS, fpfh_of_pair
from gpca.alignment.methods.interface import (
    CORRESPONDENCE_DISTANCE,
    FailedRegistration,
    MethodEntry,
    Outcome,
    Pair,
    as_array,
)
from gpca.process.environment import require_open3d
from gpca.settings import Share


def align(
    pair: Pair,
    feature_radius: float = RADIUS,
    inlier_distance: float = 0.05,
    tuple_similarity: Share = 0.95,
    tuples: int = 1000,
    iterations: int = 64,
    correspondence_distance: float = CORRESPONDENCE_DISTANCE,
    feature_neighbors: int = MOST_NEIGHBORS,
) -> Outcome:
    """Minimize a robust cost over all matches in agreeing triples.

    Args:
        feature_radius, feature_neighbors: radius in diameters and maximum number of a feature's neighbors.
        inlier_distance: final scale of the robust cost, in diameters.
        tuple_similarity: minimum ratio of the edges of the two triangles of a triple.
        tuples: maximum number of triples.
    """
    o3d = require_open3d()
    registration = o3d.pipelines.registration
    clouds, features = fpfh_of_pair(pair, feature_radius, feature_neighbors)
    o3d.utility.random.seed(pair.seed % 2**31)
    option = registration.FastGlobalRegistrationOption(
        use_absolute_scale=True,
        decrease_mu=True,
        maximum_correspondence_distance=inlier_distance,
        iteration_number=iterations,
        tuple_scale=tuple_similarity,
        maximum_tuple_count=tuples,
    )
    try:
        result = registration.registration_fgr_based_on_feature_matching(*clouds, *features, option)
    except RuntimeError as fault:  # it cannot draw triples from a single match
        raise FailedRegistration("too few correspondences agree") from fault
    T_target_source = as_array(result.transformation)
    if np.array_equal(T_target_source, np.eye(4)):  # its result for fewer than ten matches
        raise FailedRegistration("too few correspondences agree")
    return Outcome.at(pair, T_target_source, correspondence_distance)


METHODS = {"fgr": MethodEntry("Fast global registration", align, is_global=True)}
