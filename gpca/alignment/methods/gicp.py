"""Generalized ICP (Segal et al. 2009): planes in both clouds, by Open3D."""

from __future__ import annotations

from gpca.alignment.methods.interface import CORRESPONDENCE_DISTANCE, MAX_ITERATIONS, MethodEntry, Outcome, Pair
from gpca.alignment.methods.local import align_by_open3d


def align(
    pair: Pair, correspondence_distance: float = CORRESPONDENCE_DISTANCE, max_iterations: int = MAX_ITERATIONS
) -> Outcome:
    """Minimise the distances between small planes: the target's of its normals, the source's of its neighbours."""
    return align_by_open3d(pair, "generalized", correspondence_distance, max_iterations)


METHODS = {"gicp": MethodEntry("GICP", align)}
