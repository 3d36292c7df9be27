"""Registration of two scans, one point per voxel, and other poses that may fit them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.batched_icp import BatchedPlaneICP
from gpca.alignment.features import estimate_normals
from gpca.alignment.icp import ICPSettings, clipped_cost
from gpca.alignment.methods.interface import Outcome, Pair
from gpca.alignment.methods.registry import make_method
from gpca.errors import InputError
from gpca.numerals import in_decimals
from gpca.objects.canonical import thin
from gpca.pairs.distances import ObservedPair
from gpca.rigid import exp, inverse, scale_translation, transform
from gpca.scans.pair import MOST_CELLS, voxels
from gpca.seeds import generator, seed_of
from gpca.uncertainty.settings import start_deviation

SPACINGS = 2.0  # least edge of a voxel, in spacings of the points
MOST_VOXELS = 4000  # largest number of occupied voxels of a scan
GROWTH = 1.25  # least factor between tried edges
MEASURED = 5000  # number of points whose spacing is measured
COARSE_TO_FINE = (10.0, 5.0, 2.5)  # correspondence distances of successive ICPs, in voxels
ITERATIONS = 30  # of each ICP
PARTNER = 2.0  # largest distance between points of the same surface, in voxels
METHOD_UNIT = 20.0  # voxels that registration methods take for the diameter of an object: features then span five
RUNS, GLOBAL_RUNS = 8, 2  # registrations from other starts, and by features, that propose poses
START_ROTATION_DEG, START_TRANSLATION = 20.0, 0.1  # root mean square deviation of the starts; translation in extents
RUN_POINTS, ENACTED_POINTS = 1000, 512  # largest number of points per scan


def voxel_size(clouds: Mapping[str, np.ndarray], unit: str) -> float:
    """Choose the edge of the voxels for scans (N, 3), in their unit.

    It is at least twice the larger median distance between neighbors, and leaves at most `MOST_VOXELS` points per scan.
    """
    spacings = []
    for name, points in clouds.items():
        spacing = _median_gap(points) or _median_gap(np.unique(points, axis=0))
        if not 0 < spacing < np.inf:
            raise InputError(name, "has all its points in one place", "export it again")
        spacings.append(spacing)
    edge = SPACINGS * max(spacings)
    while (most := max(len(in_voxels(points, edge, name, unit)) for name, points in clouds.items())) > MOST_VOXELS:
        edge *= max(GROWTH, float(np.sqrt(most / MOST_VOXELS)))  # a surface fills a quarter of voxels twice as large
    return edge


def _median_gap(points: np.ndarray) -> float:
    sample = thin(points, MEASURED, "spacing")
    return float(np.median(cKDTree(points).query(sample, 2)[0][:, 1]))


def in_voxels(points: np.ndarray, edge: float, name: str, unit: str) -> np.ndarray:
    """Return the mean (n, 3) of the points (N, 3) in each voxel; an InputError if they span too many voxels."""
    with np.errstate(over="ignore"):
        extent_3 = np.ptp(points, axis=0)
        cells = (extent_3 / edge + 1).prod()
    if not cells < MOST_CELLS:
        fault = f"spans {in_decimals(extent_3.max(), 3)} {unit}, too much for voxels of {in_decimals(edge, 3)} {unit}"
        raise InputError(name, fault, "leave out points that are far away")
    return voxels(points, edge)


@dataclass(frozen=True)
class Scans:
    """Two scans, one point per voxel, centered on the target and in units of its extent."""

    source: np.ndarray  # (N, 3) at its initial pose
    target: np.ndarray  # (M, 3)
    voxel: float  # edge of a voxel

    def registered(self) -> Outcome:
        """Register by point-to-plane ICP, coarse to fine."""
        return self.outcome(self._aligned(self.source, np.eye(4)[None])[0])

    def registered_by(self, method: str, seed: int | None = None) -> Outcome:
        """Register by a method with its default settings, whose lengths are taken as multiples of a voxel."""
        unit = METHOD_UNIT * self.voxel
        normals_N_3, normals_M_3 = self._normals
        seed = seed_of("scans", method) if seed is None else seed
        pair = Pair(self.source / unit, self.target / unit, np.eye(4), normals_N_3, normals_M_3, seed)
        outcome = make_method(method)(pair)
        return self.outcome(scale_translation(outcome.T_target_source, unit), outcome.failure)

    def refined(self, T_k: np.ndarray) -> np.ndarray:
        """Refine poses (k, 4, 4) by the finest ICP on all voxels."""
        return self._planes[-1].register(self.source, T_k)[0]

    def outcome(self, T: np.ndarray, failure: str = "") -> Outcome:
        """Measure a pose: share of source points with a partner within two voxels, and their RMSE."""
        distance_N = self._tree.query(transform(T, self.source))[0]
        near_N = distance_N < PARTNER * self.voxel
        rmse = float(np.sqrt(np.square(distance_N[near_N]).mean())) if near_N.any() else 0.0
        return Outcome(T, float(near_N.mean()), rmse, failure)

    def misfit(self, T: np.ndarray) -> float:
        """Mean squared distance of the source points, clipped at two voxels and divided by the clipped value."""
        at, reach = self.outcome(T), PARTNER * self.voxel
        return float(clipped_cost(np.array([at.fitness]), np.array([at.inlier_rmse]), reach)[0]) / reach**2

    def overlap(self, T: np.ndarray) -> tuple[float, float]:
        """Share of the source that lies on the target at a pose, and of the target that lies on the source."""
        moved, reach = transform(T, self.source), PARTNER * self.voxel
        source_share = np.isfinite(self._tree.query(moved, distance_upper_bound=reach)[0]).mean()
        target_share = np.isfinite(cKDTree(moved).query(self.target, distance_upper_bound=reach)[0]).mean()
        return float(source_share), float(target_share)

    def pair(self, T_found: np.ndarray) -> ObservedPair:
        """Return the pair for a re-enactment, with the results of other registrations as further poses."""
        xi_n_6 = generator("scans", "starts").normal(size=(RUNS, 6))
        starts_n = exp(xi_n_6 * start_deviation(START_ROTATION_DEG, START_TRANSLATION))
        local_n = self._aligned(_drawn(self.source, RUN_POINTS, "runs"), starts_n)
        by_features = [self.registered_by("fpfh_ransac", seed_of("scans", run)) for run in range(GLOBAL_RUNS)]
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
