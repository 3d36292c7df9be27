"""Local methods that iterate outside the suite's own stages: ICP by the compiled loop, Open3D and small_gicp."""

from functools import partial
from importlib import import_module
from typing import Literal

import numpy as np

from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.features import NEIGHBORS
from gpca.alignment.icp import ICP, ICPSettings, Method
from gpca.alignment.methods.interface import ITERATIONS, REACH, FailedRegistration, MethodEntry, Outcome, Pair
from gpca.process.environment import require_open3d
from gpca.rigid import transform

# Weights by the residual r: Huber min(1, k/r), Cauchy 1/(1 + (r/k)²), Geman-McClure its square, and Tukey
# (1 - (r/k)²)² up to k.
Kernel = Literal["HuberLoss", "CauchyLoss", "GMLoss", "TukeyLoss", None]
# k, in diameters. At 0.02, the middle of the protocol's noise, a poor start makes most points outliers: on a
# development seed, Tukey aligned half of the pairs with a pose error, and nearly all at 0.05.
SCALE = 0.05
# Open3D does not report which rule stopped it. When fitness and RMSE have converged, poses still oscillate by up to
# 4e-3 diameters, as correspondences change; poses stopped by the number of iterations move more.
AT_REST = 5e-3
LAST_STEP = 1e-4  # of small_gicp, radians and diameters


def failure_of_a_step(pair: Pair, T_found: np.ndarray, T_further: np.ndarray, max_iterations: int) -> str:
    """Return the failure of a method that stopped too early, given the pose after a further step, else empty."""
    moved_N_3 = transform(T_further, pair.source) - transform(T_found, pair.source)
    moving = np.linalg.norm(moved_N_3, axis=1).max() > AT_REST
    return f"has not converged in {max_iterations} iterations" if moving else ""


def align_compiled(pair: Pair, correspondence_distance: float = REACH, max_iterations: int = ITERATIONS) -> Outcome:
    """Run the compiled loop, which ends at Open3D's poses (docs/protocol.md#two-loops-of-icp)."""
    icp = BatchedICP(pair.target, ICPSettings("point_to_point", correspondence_distance, max_iterations))
    (T,), (fitness,), (rmse,) = icp.register(pair.source, pair.T_target_source_init[None])
    if fitness == 0:
        raise FailedRegistration(f"no source point has a target point within {correspondence_distance:g} diameters")
    (T_further,), _, _ = icp.register(pair.source, T[None], max_iterations=1)
    return Outcome(T, float(fitness), float(rmse), failure_of_a_step(pair, T, T_further, max_iterations))


def align_open3d(
    method: Method, kernel: Kernel, pair: Pair, correspondence_distance: float = REACH, max_iterations: int = ITERATIONS
) -> Outcome:
    """Run Open3D's loop, with a robust kernel of the distances to planes or none; planes have the target's normals."""
    normals = None if method == "point_to_point" else pair.normals("target")
    constant = SCALE**2 if kernel == "GMLoss" else SCALE  # Open3D's Geman-McClure takes its square
    loss = getattr(require_open3d().pipelines.registration, kernel)(constant) if kernel else None
    settings = [ICPSettings(method, correspondence_distance, iterations) for iterations in (max_iterations, 1)]
    full, single = (ICP(pair.target, normals, each, loss) for each in settings)
    found = full.register(pair.source, pair.T_target_source_init)
    if found.fitness == 0:
        raise FailedRegistration(f"no source point has a target point within {correspondence_distance:g} diameters")
    further = single.register(pair.source, found.T_target_source)
    failure = failure_of_a_step(pair, found.T_target_source, further.T_target_source, max_iterations)
    return Outcome(found.T_target_source, found.fitness, found.inlier_rmse, failure)


def align_small_gicp(pair: Pair, correspondence_distance: float = REACH, max_iterations: int = ITERATIONS) -> Outcome:
    """Run generalized ICP of small_gicp (Koide 2024), whose clouds are made here, as it thins plain arrays."""
    package = import_module("small_gicp")
    source, target = package.PointCloud(pair.source), package.PointCloud(pair.target)
    tree = package.KdTree(target, num_threads=1)
    package.estimate_covariances(target, tree, num_neighbors=NEIGHBORS, num_threads=1)
    package.estimate_covariances(source, num_neighbors=NEIGHBORS, num_threads=1)

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
        return np.array(result.T_target_source, np.float64)

    T_found = step(pair.T_target_source_init, max_iterations)
    failure = failure_of_a_step(pair, T_found, step(T_found, 1), max_iterations)
    return Outcome.at(pair, T_found, correspondence_distance, failure)


_to_planes = partial(align_open3d, "point_to_plane")
METHODS = {
    "point_to_point": MethodEntry("ICP, point-to-point", align_compiled, points_only=True),
    "point_to_point_open3d": MethodEntry("ICP, point-to-point (Open3D)", partial(align_open3d, "point_to_point", None)),
    "point_to_plane": MethodEntry("ICP, point-to-plane", partial(_to_planes, None)),
    "huber": MethodEntry("ICP, point-to-plane, Huber", partial(_to_planes, "HuberLoss")),
    "cauchy": MethodEntry("ICP, point-to-plane, Cauchy", partial(_to_planes, "CauchyLoss")),
    "geman_mcclure": MethodEntry("ICP, point-to-plane, Geman-McClure", partial(_to_planes, "GMLoss")),
    "tukey": MethodEntry("ICP, point-to-plane, Tukey", partial(_to_planes, "TukeyLoss")),
    "gicp": MethodEntry("GICP", partial(align_open3d, "generalized", None)),
    "gicp_small": MethodEntry("GICP (small_gicp)", align_small_gicp, package="small_gicp", points_only=True),
}
