"""Methods by packages: Open3D's RANSAC and fast global registration on FPFH features, KISS-Matcher, and pycpd."""

import os
from functools import cache
from importlib import import_module
from typing import Annotated, Any

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.features import MOST_NEIGHBORS, RADIUS, fpfh_of_pair
from gpca.alignment.methods.interface import FEWEST, REACH, FailedRegistration, MethodEntry, Outcome, Pair
from gpca.alignment.methods.local import failure_of_a_step
from gpca.process.environment import require_open3d
from gpca.rigid import rigid_motion, transform
from gpca.seeds import generator
from gpca.settings import Bounds, OpenShare

EDGE_SIMILARITY = 0.9  # minimum ratio of the edges of the two triangles of RANSAC
CONFIDENCE = 0.999  # at which it stops
VOXEL = 0.08  # diameters; on a development seed the best for some 500 points (0.05 for 2000)
# Somewhat more than KISS-Matcher needs: three neighbors within three voxels at each remaining point.
NEAR, NEIGHBORS, FEATURES = 2.0, 4, 10


def align_by_ransac(
    pair: Pair,
    feature_radius: float = RADIUS,
    inlier_distance: float = 0.05,
    iterations: int = 20_000,
    correspondence_distance: float = REACH,
    feature_neighbors: int = MOST_NEIGHBORS,
) -> Outcome:
    """Return the pose of three matches that agrees with most others (Fischler & Bolles 1981), all in diameters."""
    registration = require_open3d().pipelines.registration
    clouds, features = fpfh_of_pair(pair, feature_radius, feature_neighbors)
    require_open3d().utility.random.seed(pair.seed % 2**31)
    result = registration.registration_ransac_based_on_feature_matching(
        *clouds,
        *features,
        mutual_filter=True,
        max_correspondence_distance=inlier_distance,
        estimation_method=registration.TransformationEstimationPointToPoint(False),
        ransac_n=FEWEST,
        checkers=[
            registration.CorrespondenceCheckerBasedOnEdgeLength(EDGE_SIMILARITY),
            registration.CorrespondenceCheckerBasedOnDistance(inlier_distance),
        ],
        criteria=registration.RANSACConvergenceCriteria(iterations, CONFIDENCE),
    )
    if len(result.correspondence_set) < FEWEST:
        raise FailedRegistration(f"fewer than {FEWEST} correspondences agree")
    return Outcome.at(pair, np.array(result.transformation, np.float64), correspondence_distance)


def align_by_fgr(
    pair: Pair,
    feature_radius: float = RADIUS,
    inlier_distance: float = 0.05,
    correspondence_distance: float = REACH,
    feature_neighbors: int = MOST_NEIGHBORS,
) -> Outcome:
    """Minimize a robust cost of the scale `inlier_distance` over all matches in agreeing triples (Zhou et al. 2016)."""
    registration = require_open3d().pipelines.registration
    clouds, features = fpfh_of_pair(pair, feature_radius, feature_neighbors)
    require_open3d().utility.random.seed(pair.seed % 2**31)
    option = registration.FastGlobalRegistrationOption(
        use_absolute_scale=True,
        decrease_mu=True,
        maximum_correspondence_distance=inlier_distance,
        iteration_number=64,
        tuple_scale=0.95,  # minimum ratio of the edges of the two triangles of a triple
        maximum_tuple_count=1000,
    )
    try:
        result = registration.registration_fgr_based_on_feature_matching(*clouds, *features, option)
    except RuntimeError as fault:  # it cannot draw triples from a single match
        raise FailedRegistration("too few correspondences agree") from fault
    T_target_source = np.array(result.transformation, np.float64)
    if np.array_equal(T_target_source, np.eye(4)):  # its result for fewer than ten matches
        raise FailedRegistration("too few correspondences agree")
    return Outcome.at(pair, T_target_source, correspondence_distance)


def align_by_kiss_matcher(pair: Pair, voxel: float = VOXEL, correspondence_distance: float = REACH) -> Outcome:
    """Match both clouds (Lim et al. 2025), thinned to voxels in diameters, which also determine all radii."""
    package = _in_one_thread(import_module("kiss_matcher"))
    for name in ("source", "target"):
        # Enough points must have enough neighbors for a normal: without any, the package ends the process.
        voxels_M_3 = np.unique(np.floor(getattr(pair, name) / max(voxel, 1e-6)), axis=0)
        neighbors_M = cKDTree(voxels_M_3).query_ball_point(voxels_M_3, NEAR, return_length=True)
        if (neighbors_M > NEIGHBORS).sum() < FEATURES:
            raise FailedRegistration(f"of the {name}, voxels of {voxel:g} diameters leave too few points")
    try:  # it rejects voxels below 0.005, and clouds with too few remaining points
        matcher = package.KISSMatcher(package.KISSMatcherConfig(voxel))
        result = matcher.estimate(pair.source.astype(np.float32), pair.target.astype(np.float32))
    except RuntimeError as fault:
        raise FailedRegistration(f"KISS-Matcher: {fault}") from fault
    if not result.valid or matcher.get_num_final_inliers() < FEWEST:
        raise FailedRegistration(f"fewer than {FEWEST} correspondences agree")
    return Outcome.at(pair, rigid_motion(result.rotation, np.ravel(result.translation)), correspondence_distance)


@cache
def _in_one_thread(package: Any) -> Any:
    """Return the package in one thread, as several race; TBB starts one for each processor at its first call."""
    process = os.getpid()
    allowed = os.sched_getaffinity(process)
    cube_N_3 = np.indices((6, 6, 6)).reshape(3, -1).T.astype(np.float32)
    os.sched_setaffinity(process, {min(allowed)})
    try:
        package.KISSMatcher(package.KISSMatcherConfig(1.0)).estimate(cube_N_3, cube_N_3)
    finally:
        os.sched_setaffinity(process, allowed)
    return package


def align_by_drift(
    pair: Pair,
    outliers: OpenShare = 0.1,
    max_iterations: int = 100,
    tolerance: float = 1e-3,
    points: Annotated[int, Bounds(minimum=FEWEST)] = 512,
    correspondence_distance: float = REACH,
) -> Outcome:
    """Drift some points of the source onto the target at its scale (Myronenko & Song 2010), until it hardly changes."""
    random = generator("registration", "drift", pair.seed)
    source, target = (cloud[np.sort(random.permutation(len(cloud))[:points])] for cloud in (pair.source, pair.target))
    drift = _at_scale_1(import_module("pycpd").RigidRegistration)(
        X=np.array(target, np.float64),
        Y=transform(pair.T_target_source_init, source),
        w=outliers,
        max_iterations=max_iterations,
        tolerance=tolerance,
    )
    poses = []
    for step in (drift.register, drift.iterate):  # one more, to see whether it has come to rest
        step()
        poses.append(rigid_motion(drift.R.T, np.ravel(drift.t)) @ pair.T_target_source_init)
    failure = failure_of_a_step(pair, poses[0], poses[1], max_iterations)
    return Outcome.at(pair, poses[0], correspondence_distance, failure)


def _at_scale_1(registration: Any) -> Any:
    """Return the package's class, which estimates a scale as well, with a scale of 1: rigid bodies do not shrink."""

    class Drift(registration):
        s: float

        def update_transform(self) -> None:
            super().update_transform()
            self.t += (self.s - 1) * (self.P1 @ self.Y / self.Np) @ self.R
            self.s = 1.0

        def update_variance(self) -> None:
            super().update_variance()
            # The package's own is that of the best scale, where Σ|x|² - tr(AR) is what is left.
            left = self.Pt1 @ np.square(self.X_hat).sum(axis=1) - 2 * np.trace(self.A @ self.R) + self.YPY
            self.sigma2 = max(left / (self.Np * self.D), self.tolerance / 10)

    return Drift


METHODS = {
    "fpfh_ransac": MethodEntry("FPFH and RANSAC", align_by_ransac, is_global=True),
    "fgr": MethodEntry("Fast global registration", align_by_fgr, is_global=True),
    "kiss_matcher": MethodEntry("KISS-Matcher", align_by_kiss_matcher, is_global=True, package="kiss_matcher"),
    "cpd": MethodEntry("Coherent point drift", align_by_drift, package="pycpd", points_only=True),
}
