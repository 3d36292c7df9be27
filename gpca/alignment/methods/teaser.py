"""TEASER (Yang et al. 2021): its decoupled solver on mutual matches of FPFH features."""

from __future__ import annotations

from gpca.alignment.decoupled import solve
from gpca.alignment.features import MOST_NEIGHBORS, RADIUS, fpfh_of_pair, mutual_matches
from gpca.alignment.methods.interface import (
    CORRESPONDENCE_DISTANCE,
    FEWEST,
    FailedRegistration,
    MethodEntry,
    Outcome,
    Pair,
)


def align(
    pair: Pair,
    feature_radius: float = RADIUS,
    noise: float = 0.05,
    most_matches: int = 300,
    correspondence_distance: float = CORRESPONDENCE_DISTANCE,
    feature_neighbors: int = MOST_NEIGHBORS,
) -> Outcome:
    """Solve for the pose on which the largest set of matches agrees.

    Args:
        feature_radius, feature_neighbors: of the features, in diameters; of the points within it, the nearest so many.
        noise: how far a right match may be off, in diameters: about the spacing of the points.
        most_matches: the best so many are used; TEASER's authors advise some hundreds.
    """
    _, features = fpfh_of_pair(pair, feature_radius, feature_neighbors)
    source_N_33, target_P_33 = (each.data.T for each in features)
    rows_n_2 = mutual_matches(source_N_33, target_P_33, most_matches)
    solution = solve(pair.source[rows_n_2[:, 0]], pair.target[rows_n_2[:, 1]], noise)
    if solution is None or len(solution.inliers) < FEWEST:
        raise FailedRegistration(f"fewer than {FEWEST} correspondences agree")
    return Outcome.at(pair, solution.T_target_source, correspondence_distance)


METHODS = {"teaser": MethodEntry("TEASER's solver", align, is_global=True)}
