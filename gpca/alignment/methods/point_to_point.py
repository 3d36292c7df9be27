"""Point-to-point ICP (Besl & McKay 1992): the compiled loop for many starts, and Open3D's."""

from __future__ import annotations

from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.icp import ICPSettings
from gpca.alignment.methods.interface import (
    CORRESPONDENCE_DISTANCE,
    MAX_ITERATIONS,
    FailedRegistration,
    MethodEntry,
    Outcome,
    Pair,
    align_by_open3d,
    failure_of_a_step,
)


def align(
    pair: Pair, correspondence_distance: float = CORRESPONDENCE_DISTANCE, max_iterations: int = MAX_ITERATIONS
) -> Outcome:
    """Run the compiled loop, which ends at Open3D's poses (docs/protocol.md#two-loops-of-icp)."""
    settings = ICPSettings("point_to_point", correspondence_distance, max_iterations)
    icp = BatchedICP(pair.target, settings)
    T_1, fitness_1, rmse_1 = icp.register(pair.source, pair.T_target_source_init[None])
    if fitness_1[0] == 0:
        raise FailedRegistration(f"no source point has a target point within {correspondence_distance:g} diameters")
    further_1, _, _ = icp.register(pair.source, T_1, max_iterations=1)
    failure = failure_of_a_step(pair, T_1[0], further_1[0], max_iterations)
    return Outcome(T_1[0], float(fitness_1[0]), float(rmse_1[0]), failure)


def align_open3d(
    pair: Pair, correspondence_distance: float = CORRESPONDENCE_DISTANCE, max_iterations: int = MAX_ITERATIONS
) -> Outcome:
    """Run Open3D's loop."""
    return align_by_open3d(pair, "point_to_point", correspondence_distance, max_iterations)


METHODS = {
    "point_to_point": MethodEntry("ICP, point-to-point", align),
    "point_to_point_open3d": MethodEntry("ICP, point-to-point (Open3D)", align_open3d),
}
