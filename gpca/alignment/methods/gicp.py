"""Generalized ICP (Segal et al. 2009): planes in both clouds, by Open3D and the optional small_gicp (Koide 2024)."""

from __future__ import annotations

from importlib import import_module

import numpy as np

from gpca.alignment.methods.interface import (
    CORRESPONDENCE_DISTANCE,
    MAX_ITERATIONS,
    MethodEntry,
    Outcome,
    Pair,
    align_by_open3d,
    as_array,
    failure_of_a_step,
)

LAST_STEP = 1e-4  # of small_gicp, radians and diameters


def align(
    pair: Pair, correspondence_distance: float = CORRESPONDENCE_DISTANCE, max_iterations: int = MAX_ITERATIONS
) -> Outcome:
    """Minimize the distances between small planes, from the target's normals and the source's neighbors."""
    return align_by_open3d(pair, "generalized", correspondence_distance, max_iterations)


def align_by_small_gicp(
    pair: Pair,
    neighbours: int = 20,
    correspondence_distance: float = CORRESPONDENCE_DISTANCE,
    max_iterations: int = MAX_ITERATIONS,
) -> Outcome:
    """Minimize the distances between small planes, each from `neighbours` points.

    Clouds and tree are made here, because small_gicp thins plain arrays to cells of 0.25 units, a quarter of an object.
    Its limits of the last step are for scans in meters; here they are smaller. Noisy clouds never reach them, so one
    further step decides whether it has converged, as for the other methods.
    """
    package = import_module("small_gicp")
    source, target = package.PointCloud(pair.source), package.PointCloud(pair.target)
    tree = package.KdTree(target, num_threads=1)
    package.estimate_covariances(target, tree, num_neighbors=neighbours, num_threads=1)
    package.estimate_covariances(source, num_neighbors=neighbours, num_threads=1)

    def step(T_target_source: np.ndarray, iterations: int) -> np.ndarray:
        result = package.align(
            target,
            source,
            tree,
            init_T_target_source=T_target_source,
            max_correspondence_distance=correspondence_distance,
            num_threads=1,
            max_iterations=iterations,
            rotation_epsilon=LAST_STEP,
            translation_epsilon=LAST_STEP,
        )
        return as_array(result.T_target_source)

    T_found = step(pair.T_target_source_init, max_iterations)
    failure = failure_of_a_step(pair, T_found, step(T_found, 1), max_iterations)
    return Outcome.at(pair, T_found, correspondence_distance, failure)


METHODS = {
    "gicp": MethodEntry("GICP", align),
    "gicp_small": MethodEntry("GICP (small_gicp)", align_by_small_gicp, package="small_gicp"),
}
