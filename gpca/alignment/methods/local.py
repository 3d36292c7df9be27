"""Local methods: one further step tells whether they have come to rest."""

from __future__ import annotations

from typing import Any

import numpy as np

from gpca.alignment.icp import ICP, ICPSettings, Method
from gpca.alignment.methods.interface import FailedRegistration, Outcome, Pair, still_moving
from gpca.alignment.rigid import transform

# Open3D does not tell which of its two rules has stopped it. Where fitness and RMSE have settled, poses still go to and
# fro by up to 4e-3 diameters, as correspondences change; those that the number of iterations has stopped on their way
# move by more. A pose is correct within 0.1 diameters.
AT_REST = 5e-3


def align_by_open3d(
    pair: Pair, method: Method, correspondence_distance: float, max_iterations: int, kernel: Any = None
) -> Outcome:
    """Run one of Open3D's local methods, with a robust kernel if one is given."""
    normals = None if method == "point_to_point" else pair.normals("target")

    def icp(iterations: int) -> ICP:
        return ICP(pair.target, normals, ICPSettings(method, correspondence_distance, iterations), kernel)

    found = icp(max_iterations).register(pair.source, pair.T_target_source_init)
    if found.fitness == 0:
        raise FailedRegistration(f"no source point has a target point within {correspondence_distance:g} diameters")
    step = icp(1).register(pair.source, found.T_target_source)
    failure = failure_of_a_step(pair, found.T_target_source, step.T_target_source, max_iterations)
    return Outcome(found.T_target_source, found.fitness, found.inlier_rmse, failure)


def failure_of_a_step(pair: Pair, T_found: np.ndarray, T_further: np.ndarray, max_iterations: int) -> str:
    """Return why a method must not stop at a pose, given the pose after one more step; empty if it may."""
    moved_N_3 = transform(T_further, pair.source) - transform(T_found, pair.source)
    return still_moving(max_iterations) if np.linalg.norm(moved_N_3, axis=1).max() > AT_REST else ""
