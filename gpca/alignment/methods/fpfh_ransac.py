"""RANSAC (Fischler & Bolles 1981) over matches of FPFH features, by Open3D."""

from __future__ import annotations

from gpca.alignment.features import MOST_NEIGHBORS, RADIUS, fpfh_of_pair
from gpca.alignment.methods.interface import (
    CORRESPONDENCE_DISTANCE,
    FEWEST,
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
    edge_similarity: Share = 0.9,
    iterations: int = 20_000,
    confidence: Share = 0.999,
    correspondence_distance: float = CORRESPONDENCE_DISTANCE,
    feature_neighbors: int = MOST_NEIGHBORS,
) -> Outcome:
    """Return the pose of three matches that agrees with most others.

    Args:
        feature_radius, feature_neighbors: radius in diameters and maximum number of a feature's neighbors.
        inlier_distance: of an agreeing match, in diameters.
        edge_similarity: minimum ratio of the edges of the two triangles.
        iterations, confidence: stopping rules.
    """
    o3d = require_open3d()
    registration = o3d.pipelines.registration
    clouds, features = fpfh_of_pair(pair, feature_radius, feature_neighbors)
    o3d.utility.random.seed(pair.seed % 2**31)
    result = registration.registration_ransac_based_on_feature_matching(
        *clouds,
        *features,
        mutual_filter=True,
        max_correspondence_distance=inlier_distance,
        estimation_method=registration.TransformationEstimationPointToPoint(False),
        ransac_n=FEWEST,
        checkers=[
            registration.CorrespondenceCheckerBasedOnEdgeLength(edge_similarity),
            registration.CorrespondenceCheckerBasedOnDistance(inlier_distance),
        ],
        criteria=registration.RANSACConvergenceCriteria(iterations, confidence),
    )
    if len(result.correspondence_set) < FEWEST:
        raise FailedRegistration(f"fewer than {FEWEST} correspondences agree")
    return Outcome.at(pair, as_array(result.transformation), correspondence_distance)


METHODS = {"fpfh_ransac": MethodEntry("FPFH and RANSAC", align, is_global=True)}
