"""Generalized ICP by small_gicp (Koide 2024), a package that the suite does without."""

from __future__ import annotations

from importlib import import_module

from gpca.alignment.methods.interface import (
    CORRESPONDENCE_DISTANCE,
    MAX_ITERATIONS,
    MethodEntry,
    Outcome,
    Pair,
    as_array,
    still_moving,
)

LAST_STEP = 1e-4  # radians and diameters


def align(
    pair: Pair,
    neighbours: int = 20,
    correspondence_distance: float = CORRESPONDENCE_DISTANCE,
    max_iterations: int = MAX_ITERATIONS,
) -> Outcome:
    """Minimise the distances between small planes, each of so many neighbours.

    Clouds and tree are made here: given plain arrays, small_gicp thins them to cells of 0.25 units, a quarter of an
    object. Its limits on the last step are those of scans in metres, 1e-3 and 0.1 degrees; here they are smaller.
    """
    package = import_module("small_gicp")
    source, target = package.PointCloud(pair.source), package.PointCloud(pair.target)
    tree = package.KdTree(target, num_threads=1)
    package.estimate_covariances(target, tree, num_neighbors=neighbours, num_threads=1)
    package.estimate_covariances(source, num_neighbors=neighbours, num_threads=1)
    found = package.align(
        target,
        source,
        tree,
        init_T_target_source=pair.T_target_source_init,
        max_correspondence_distance=correspondence_distance,
        num_threads=1,
        max_iterations=max_iterations,
        rotation_epsilon=LAST_STEP,
        translation_epsilon=LAST_STEP,
    )
    failure = "" if found.converged else still_moving(max_iterations)
    return Outcome.at(pair, as_array(found.T_target_source), correspondence_distance, failure)


METHODS = {"gicp_small": MethodEntry("GICP (small_gicp)", align, package="small_gicp")}
