"""Registration of two scans, one point per voxel, and other poses that may fit them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.batched_icp import AnyICP, BatchedICP, BatchedPlaneICP
from gpca.alignment.features import NEIGHBORS, estimate_normals
from gpca.alignment.icp import ICPSettings, Method, clipped_cost
from gpca.alignment.methods.interface import Outcome, Pair
from gpca.alignment.methods.registry import make_method
from gpca.alignment.pose_error import displacements
from gpca.causes.candidate import Registrar
from gpca.causes.scans import OverlapErrors, ScanCandidate
from gpca.causes.settings import FEWEST_POINTS, OBSERVED, CauseSettings
from gpca.causes.truth import SUBSETS, capped
from gpca.errors import InputError
from gpca.numerals import in_decimals
from gpca.objects.canonical import thin
from gpca.pairs.perturbation import OVERLAP
from gpca.reenactment.enactment import Enactment, NoiseScale
from gpca.reenactment.hypotheses import INDEPENDENT, NEGLIGIBLE, Hypothesis, find_hypotheses
from gpca.reenactment.scans import cropped
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import dots, exp, inverse, inverses, rotate, scale_translation, transform
from gpca.scans.pair import MOST_CELLS, voxels
from gpca.seeds import generator, seed_of
from gpca.uncertainty.estimators.interface import CovarianceEstimate, RegisteredPair
from gpca.uncertainty.estimators.registry import make_estimator
from gpca.uncertainty.settings import MONTE_CARLO, UncertaintySettings, start_deviation

SPACINGS = 2.0  # least edge of a voxel, in spacings of the points
MOST_VOXELS = 4000  # largest number of occupied voxels of a scan
GROWTH = 1.25  # least factor between tried edges
MEASURED = 5000  # number of points whose spacing is measured
COARSE_TO_FINE = (10.0, 5.0, 2.5)  # correspondence distances of successive ICPs, in voxels
FLAT = 0.01  # of the middle extent: a cloud whose smallest is no larger is flat, and has no normals that move it
THICK = 0.15  # between development scenes, up to .08, and noise, from .2
ITERATIONS = 30  # of each ICP
PARTNER = 2.0  # largest distance between points of the same surface, in voxels
ALIKE = 0.8  # cosine of the largest angle between their normals
AWAY = 0.5  # voxels from its plane, from which a point fits no better than one without partner
# So far (voxels) from all points of the other scan, a point may lie where that scan saw nothing: this is its misfit, as
# compared on development scenes. Nearer, the other scan would show the same surface, and the misfit is 1.
UNSEEN, UNSEEN_MISFIT = 5.0, 0.5
METHOD_UNIT = 20.0  # voxels that registration methods take for the diameter of an object: features then span five
RUNS, GLOBAL_RUNS = 8, 2  # registrations from other starts, and by features, that propose poses
START_ROTATION_DEG, START_TRANSLATION = 20.0, 0.1  # root mean square deviation of the starts; translation in extents
RUN_POINTS, SEARCH_POINTS = 1000, 512  # largest number of points per scan
TRUTH = CauseSettings(moved=OBSERVED)  # of re-enactments
MOST_POSES = 4  # that are shown and enacted
UPRIGHT = 0.9  # cosine of the largest angle between the planes of flat scans


def voxel_size(clouds: Mapping[str, np.ndarray], unit: str) -> float:
    """Choose the edge of voxels for scans (N, 3): two spacings of the points, with at most `MOST_VOXELS` per scan."""
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


Oriented = tuple[np.ndarray, np.ndarray | None]  # points (N, 3) and their normals


class PossiblePose(NamedTuple):
    """A pose (4×4) that may be true."""

    T: np.ndarray
    log_posterior: float


class VoxelICP:
    """ICP to a target (M, 3), coarse to fine and at the finest level; the better counts. Flat without normals."""

    def __init__(self, target: np.ndarray, normals: np.ndarray | None, voxel: float) -> None:
        self._reach = COARSE_TO_FINE[-1] * voxel
        method: Method = "point_to_point" if normals is None else "point_to_plane"
        levels = [ICPSettings(method, far * voxel, ITERATIONS) for far in COARSE_TO_FINE]
        self._levels: list[AnyICP] = [
            BatchedICP(target, level) if normals is None else BatchedPlaneICP(target, normals, level)
            for level in levels
        ]

    def register(self, source: np.ndarray, T_n: np.ndarray) -> tuple[np.ndarray, ...]:
        """Align points (N, 3) from poses (n, 4, 4), as :meth:`BatchedICP.register`."""
        near_n = T_n
        for icp in self._levels[:-1]:
            near_n = icp.register(source, near_n)[0]
        ends = self.refine(source, np.concatenate([T_n, near_n]))
        cost_2_n = clipped_cost(ends[1], ends[2], self._reach).reshape(2, -1)
        better_n = cost_2_n.argmin(axis=0) * len(T_n) + np.arange(len(T_n))
        return tuple(part[better_n] for part in ends)

    def refine(self, source: np.ndarray, T_n: np.ndarray) -> tuple[np.ndarray, ...]:
        """Align at the finest level alone."""
        return self._levels[-1].register(source, T_n)


@dataclass(frozen=True, kw_only=True)
class VoxelCandidate(ScanCandidate):
    """Two scans that are registered by :class:`VoxelICP`."""

    normals: np.ndarray | None  # (P, 3) of the target
    voxel: float

    def icp(self, target: np.ndarray, causes: tuple[int, ...], settings: ICPSettings) -> VoxelICP:
        """Return the ICP to the target with these of the applied causes."""
        if self.normals is None or OVERLAP in causes:
            return VoxelICP(target, self.normals, self.voxel)
        return VoxelICP(target, self.normals[self.model_common], self.voxel)


@dataclass(frozen=True)
class Scans:
    """Two scans, one point per voxel, centered on the target and in units of its extent."""

    source: np.ndarray  # (N, 3) at its initial pose
    target: np.ndarray  # (M, 3)
    voxel: float  # edge of a voxel

    def registered(self, method: str | None = None, seed: int | None = None) -> Outcome:
        """Register by ICP, or by a method with its default settings, whose lengths are multiples of a voxel."""
        if method is None:
            return self.outcome(self._icp.register(self.source, np.eye(4)[None])[0][0])
        unit = METHOD_UNIT * self.voxel
        pair = self._in_voxels(seed_of("scans", method) if seed is None else seed)
        outcome = make_method(method)(pair)
        return self.outcome(scale_translation(outcome.T_target_source, unit), outcome.failure)

    def outcome(self, T: np.ndarray, failure: str = "") -> Outcome:
        """Measure a pose: share of source points with a partner within two voxels, and their RMSE."""
        distance_N = self._tree.query(transform(T, self.source))[0]
        near_N = distance_N < PARTNER * self.voxel
        rmse = float(np.sqrt(np.square(distance_N[near_N]).mean())) if near_N.any() else 0.0
        return Outcome(T, float(near_N.mean()), rmse, failure)

    def misfit(self, T: np.ndarray) -> float:
        """Return how badly both scans fit at a pose: the mean over their points, from 0 to 1 (docs/appendix.md)."""
        source_normals, target_normals = self._normals
        moved = transform(T, self.source)
        turned = None if source_normals is None else rotate(T, source_normals)
        onto = self._unlike((moved, turned), (self.target, target_normals), self._tree)
        return (onto + self._unlike((self.target, target_normals), (moved, turned), cKDTree(moved))) / 2

    def _unlike(self, points: Oriented, others: Oriented, tree: cKDTree) -> float:
        distance_N, row_N = tree.query(points[0])
        if points[1] is None or others[1] is None:  # a flat scan has few surfaces, and each of them tells
            return float(np.minimum(np.square(distance_N / self.voxel), 1).mean())
        unmatched_N = np.where(distance_N > UNSEEN * self.voxel, UNSEEN_MISFIT, 1.0)
        normals_N_3 = others[1][row_N]
        alike_N = (distance_N < PARTNER * self.voxel) & (np.abs(dots(points[1], normals_N_3)) > ALIKE)
        from_plane_N = dots(points[0] - others[0][row_N], normals_N_3) / (AWAY * self.voxel)
        return float(np.where(alike_N, np.minimum(np.square(from_plane_N), 1), unmatched_N).mean())

    def overlap(self, T: np.ndarray) -> tuple[float, float]:
        """Share of the source that lies on the target at a pose, and of the target that lies on the source."""
        moved = transform(T, self.source)
        return float(self._near(moved).mean()), float(self._near(self.target, cKDTree(moved)).mean())

    def estimated(self, estimator: str, outcome: Outcome, method: str) -> CovarianceEstimate:
        """Estimate the covariance of a result of a method, in radians and extents."""
        settings, unit = UncertaintySettings(), METHOD_UNIT * self.voxel
        estimate = make_estimator(estimator, {"starts": settings.starts} if estimator == MONTE_CARLO else {})
        scaled = replace(outcome, T_target_source=scale_translation(outcome.T_target_source, 1 / unit))
        pair = self._in_voxels(seed_of("scans", "estimate"))
        estimated = estimate(RegisteredPair(pair, scaled, method, settings.deviation_6()))
        if estimated.covariance_6_6 is None:
            return estimated
        scale_6 = np.repeat([1.0, unit], 3)
        return CovarianceEstimate(estimated.covariance_6_6 * np.outer(scale_6, scale_6))

    def _in_voxels(self, seed: int) -> Pair:
        unit = METHOD_UNIT * self.voxel
        source_normals, target_normals = self._normals
        return Pair(self.source / unit, self.target / unit, np.eye(4), source_normals, target_normals, seed)

    def common(self, T: np.ndarray) -> np.ndarray:
        """Return the points (n, 3) of the source that lie on the target at a pose, or all if hardly any does."""
        moved = transform(T, self.source)
        near_N = self._near(moved)
        return moved[near_N] if near_N.sum() >= FEWEST_POINTS else moved

    def _near(self, points: np.ndarray, tree: cKDTree | None = None) -> np.ndarray:
        return np.isfinite((tree or self._tree).query(points, distance_upper_bound=PARTNER * self.voxel)[0])

    def poses(self, T_found: np.ndarray, same: float) -> list[PossiblePose]:
        """Return poses that may be true, refined, the best first and none within `same`; the result is among them."""
        xi_n_6 = generator("scans", "starts").normal(size=(RUNS, 6))
        starts_n = exp(xi_n_6 * start_deviation(START_ROTATION_DEG, START_TRANSLATION))
        T_n = [T_found, *self._icp.register(_drawn(self.source, RUN_POINTS, "runs"), starts_n)[0]]
        if not self.flat:  # features are those of surfaces
            by_features = [self.registered("fpfh_ransac", seed_of("scans", run)) for run in range(GLOBAL_RUNS)]
            T_n += [run.T_target_source for run in by_features if run.converged]
        random = generator("scans", "hypotheses")
        T_n += [each.T for each in find_hypotheses(self.few, self.coarse, np.stack(T_n), ReenactmentSettings(), random)]
        ends = [T_found, *self._icp.refine(self.source, np.stack(T_n))[0]]
        misfits = [self.misfit(T) for T in ends]
        distinct: list[PossiblePose] = []
        for row in (0, *np.argsort(misfits, kind="stable")):
            T, posterior = ends[row], -INDEPENDENT * misfits[row]
            if row and self.flat and T[:3, :3] @ _axes(self.source)[0] @ _axes(self.target)[0] <= UPRIGHT:
                continue  # it turns the plane of the scans over
            apart = [displacements((T @ inverse(other))[None], self.common(other))[0] for other, _ in distinct]
            if apart and min(apart) <= same:
                alike = int(np.argmin(apart))
                distinct[alike] = PossiblePose(distinct[alike].T, max(distinct[alike].log_posterior, posterior))
            else:
                distinct.append(PossiblePose(T, posterior))
        least = max(pose.log_posterior for pose in distinct) - NEGLIGIBLE
        result, *others = distinct
        kept = [result, *(other for other in others if other.log_posterior > least)][:MOST_POSES]
        return sorted(kept, key=lambda pose: -pose.log_posterior)

    def enacted(self, pose: PossiblePose, T_found: np.ndarray) -> Enactment:
        """Register again with each subset of the causes, as if a pose were true; all of them gave the result."""
        T, few = pose.T, _drawn(self.source, RUN_POINTS, "runs")
        hypothesis = Hypothesis(T, np.ones(len(few)), 0.0, self.voxel, 1.0, pose.log_posterior, np.zeros(len(few)))
        scans = vars(cropped(hypothesis, few, *self._whole))
        candidate = VoxelCandidate(**scans, normals=self._normals[1], voxel=self.voxel)
        errors = OverlapErrors(candidate.clean[candidate.seen], 1.0)
        registrar, nothing = Registrar(candidate, TRUTH, misses=True), np.zeros((1, 6))
        result_error = displacements((T_found @ inverse(T))[None], self.common(T))
        error_of = {candidate.present: float(capped(result_error)[0])}
        error_8 = np.empty(len(SUBSETS))
        for b, subset in enumerate(SUBSETS):
            causes = tuple(cause for cause in subset if candidate.applied[cause])
            if causes not in error_of:
                T_n = registrar.run(causes, nothing).T_target_source_n
                error_of[causes] = float(capped(errors(inverses(T_n)))[0])
            error_8[b] = error_of[causes]
        return Enactment(hypothesis, candidate, error_8, np.zeros(len(SUBSETS)), errors, 0.0)

    @cached_property
    def flat(self) -> bool:
        """Whether either scan is flat, as those of 2-D lidars are."""
        return any(_axes(points)[1] <= FLAT for points in (self.source, self.target))

    @cached_property
    def fills_volume(self) -> bool:
        """Whether either scan fills a volume, as noise does, instead of lying on surfaces."""
        return any(_thickness(points) > THICK for points in (self.source, self.target))

    @cached_property
    def few(self) -> np.ndarray:
        """Some of the source's points."""
        return _drawn(self.source, SEARCH_POINTS, "source")

    @cached_property
    def coarse(self) -> ModelSurface:
        """Some of the target's points."""
        return ModelSurface(_drawn(self.target, SEARCH_POINTS, "target"))

    @cached_property
    def _normals(self) -> tuple[np.ndarray, np.ndarray] | tuple[None, None]:
        return (None, None) if self.flat else (estimate_normals(self.source), estimate_normals(self.target))

    @cached_property
    def _icp(self) -> VoxelICP:
        return VoxelICP(self.target, self._normals[1], self.voxel)

    @cached_property
    def _whole(self) -> tuple[ModelSurface, NoiseScale]:
        surface = ModelSurface(self.target)
        return surface, NoiseScale(surface, generator("scans", "noise"))

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.target)


def _drawn(points: np.ndarray, most: int, role: str) -> np.ndarray:
    return points[np.sort(generator("scans", role).permutation(len(points))[:most])]


def _thickness(points: np.ndarray) -> float:
    """Return the median share of variance off the plane of `NEIGHBORS` points: 0 on a plane, a third in a volume."""
    drawn = _drawn(points, RUN_POINTS, "thickness")
    near_N_k_3 = points[cKDTree(points).query(drawn, k=NEIGHBORS)[1]]
    near_N_k_3 = near_N_k_3 - near_N_k_3.mean(axis=1, keepdims=True)
    variance_N_3 = np.linalg.eigvalsh(np.einsum("nki,nkj->nij", near_N_k_3, near_N_k_3))
    return float(np.median(variance_N_3[:, 0] / variance_N_3.sum(axis=1)))


def _axes(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the direction (3,) of the smallest extent of points (N, 3), upward, and its ratio to the middle extent."""
    variance_3, axes_3_3 = np.linalg.eigh(np.cov(points.T))
    smallest = axes_3_3[:, 0]
    upward = smallest * np.sign(smallest[np.abs(smallest).argmax()])
    return upward, float(np.sqrt(max(variance_3[0], 0) / variance_3[1]))
