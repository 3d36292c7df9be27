"""Registers two scans in voxels, and proposes other poses that might fit them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.batched_icp import BatchedPlaneICP
from gpca.alignment.features import estimate_normals
from gpca.alignment.icp import ICPSettings, clipped_cost
from gpca.alignment.methods.interface import Outcome, Pair
from gpca.alignment.methods.registry import make_method
from gpca.alignment.rigid import inverse, scale_translation, transform
from gpca.alignment.twist import exp
from gpca.features.pair import ObservedPair
from gpca.seeds import generator, seed_of
from gpca.uncertainty.settings import start_deviation

COARSE_TO_FINE = (10.0, 5.0, 2.5)  # voxels that ICP looks for a partner, one after the other
ITERATIONS = 30  # of each
PARTNER = 2.0  # voxels; so close lies a point of the same surface
METHOD_UNIT = 20.0  # voxels that registration methods take for the diameter of an object: features then reach five
RUNS, GLOBAL_RUNS = 8, 2  # registrations from other starts, and by features, that propose poses
START_ROTATION_DEG, START_TRANSLATION = 20.0, 0.1  # root mean square of the other starts, the latter in extents
RUN_POINTS, ENACTED_POINTS = 1000, 512  # of each scan, at most


@dataclass(frozen=True)
class Scans:
    """Two scans, one point per voxel, about the middle of the target and in its extents.

    Attributes:
        source: (N, 3) where the registration begins.
        target: (M, 3).
        voxel: edge of a voxel.
    """

    source: np.ndarray
    target: np.ndarray
    voxel: float

    def registered(self) -> Outcome:
        """Align by point-to-plane ICP, coarse to fine, from where the source is."""
        return self.outcome(self._aligned(self.source, np.eye(4)[None])[0])

    def registered_by(self, method: str) -> Outcome:
        """Align by a registration method with its default settings, which for this scan are numbers of voxels."""
        return self._by_method(method, seed_of("scans", method))

    def refined(self, T_k: np.ndarray) -> np.ndarray:
        """Return poses (k, 4, 4) after the finest ICP on all voxels."""
        return self._planes[-1].register(self.source, T_k)[0]

    def outcome(self, T: np.ndarray, failure: str = "") -> Outcome:
        """Measure a pose: the share of the source with a partner within two voxels, and the RMSE over those."""
        distance_N = self._tree.query(transform(T, self.source))[0]
        near_N = distance_N < PARTNER * self.voxel
        rmse = float(np.sqrt(np.square(distance_N[near_N]).mean())) if near_N.any() else 0.0
        return Outcome(T, float(near_N.mean()), rmse, failure)

    def misfit(self, T: np.ndarray) -> float:
        """Return the mean squared distance of the source's points, cut off at two voxels and as a share of that."""
        at, reach = self.outcome(T), PARTNER * self.voxel
        return float(clipped_cost(np.array([at.fitness]), np.array([at.inlier_rmse]), reach)[0]) / reach**2

    def overlap(self, T: np.ndarray) -> tuple[float, float]:
        """Return the share of the source that lies on the target at a pose, and of the target that lies on it."""
        moved, reach = transform(T, self.source), PARTNER * self.voxel
        of_source = np.isfinite(self._tree.query(moved, distance_upper_bound=reach)[0]).mean()
        of_target = np.isfinite(cKDTree(moved).query(self.target, distance_upper_bound=reach)[0]).mean()
        return float(of_source), float(of_target)

    def pair(self, T_found: np.ndarray) -> ObservedPair:
        """Return the pair as a re-enactment reads it, with the poses that other registrations ended at."""
        xi_n_6 = generator("scans", "starts").normal(size=(RUNS, 6))
        starts_n = exp(xi_n_6 * start_deviation(START_ROTATION_DEG, START_TRANSLATION))
        local_n = self._aligned(_drawn(self.source, RUN_POINTS, "runs"), starts_n)
        by_features = [self._by_method("fpfh_ransac", seed_of("scans", run)) for run in range(GLOBAL_RUNS)]
        T_n = np.stack([T_found, *local_n, *(run.T_target_source for run in by_features if run.converged)])
        return ObservedPair(
            observed=transform(T_found, _drawn(self.source, ENACTED_POINTS, "source")),
            model=_drawn(self.target, ENACTED_POINTS, "target"),
            T_init=inverse(T_found),
            T_runs=T_n @ inverse(T_found),
            fitness_n=np.ones(len(T_n)),
            inlier_rmse_n=np.zeros(len(T_n)),
            axes=("scans",),
        )

    def _aligned(self, source: np.ndarray, T_n: np.ndarray) -> np.ndarray:
        for icp in self._planes:
            T_n = icp.register(source, T_n)[0]
        return T_n

    def _by_method(self, method: str, seed: int) -> Outcome:
        unit = METHOD_UNIT * self.voxel
        normals_N_3, normals_M_3 = self._normals
        pair = Pair(self.source / unit, self.target / unit, np.eye(4), normals_N_3, normals_M_3, seed)
        found = make_method(method)(pair)
        return self.outcome(scale_translation(found.T_target_source, unit), found.failure)

    @cached_property
    def _normals(self) -> tuple[np.ndarray, np.ndarray]:
        return estimate_normals(self.source), estimate_normals(self.target)

    @cached_property
    def _planes(self) -> list[BatchedPlaneICP]:
        settings = [ICPSettings("point_to_plane", far * self.voxel, ITERATIONS) for far in COARSE_TO_FINE]
        return [BatchedPlaneICP(self.target, self._normals[1], each) for each in settings]

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.target)


def _drawn(points: np.ndarray, most: int, role: str) -> np.ndarray:
    return points[np.sort(generator("scans", role).permutation(len(points))[:most])]
