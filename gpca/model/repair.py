"""Repair: a wrong pose gives way to a hypothesis of the true one, if that is right; lengths are in diameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from gpca.alignment.batched_icp import BatchedICP, icp_to
from gpca.alignment.icp import ICPSettings, clipped_cost
from gpca.alignment.methods.interface import Pair
from gpca.alignment.methods.registry import make_method
from gpca.causes.settings import MODEL, Moved
from gpca.model.result import Calibrated, Evidence, ResultJudge
from gpca.pairs.distances import ObservedPair
from gpca.reenactment import hypotheses
from gpca.reenactment.enactment import Stayed
from gpca.reenactment.mixture import Mixture, densities_of
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import inverse, inverses, transform
from gpca.seeds import generator

GOOD, REPAIRED, NOT_REPAIRED, SEVERAL = VERDICTS = ("good", "repaired", "not repaired", "several poses fit")
LEAST_WEIGHT = 0.05  # of a pose that is offered beside others
LARGE = 0.5  # of the largest distance: from this on, a point belongs to the part in which two poses differ
OF_ESTIMATE = 0.5  # probability of the estimate of the true pose beside the hypotheses
SWEPT, SWEPT_MODEL, CONTINUED = 64, 128, 6  # points that ICP sees from many starts; ends from which it sees all

Refine = Callable[[np.ndarray, np.ndarray], np.ndarray]  # observed points (N, 3), poses (k, 4, 4) -> where they end
Measure = Callable[[np.ndarray], tuple[np.ndarray, ...]]  # poses (n, 4, 4) -> fitness (n,), inlier RMSE (n,)


@dataclass(frozen=True)
class Proposals:
    """A registered pose and those that may take its place."""

    T_n: np.ndarray  # (n, 4, 4) the registered pose; then hypotheses, refined, each once, the most probable first
    weight_n: np.ndarray  # (n,) probabilities of the hypotheses that end there, 0 for the registered pose
    evidence: Evidence  # of the n poses, as :class:`TruePoses` has it
    true_poses: TruePoses | None = None  # None where it was read from a file


@dataclass(frozen=True)
class Verdict:
    """What became of a registration."""

    name: str  # one of `VERDICTS`
    row: int  # of the pose to use, among the proposals: the registered one unless it was repaired
    rows: tuple[int, ...]  # of the poses that fit, if several do: one of them is right
    probability_n: np.ndarray  # of each proposal to be off by more than the tolerance


def propose(
    observed: np.ndarray,
    surface: ModelSurface,
    T_registered: np.ndarray,
    T_K: np.ndarray,
    weight_K: np.ndarray,
    refine: Refine,
    measure: Measure,
    up_to_symmetry: bool = False,
) -> Proposals:
    """Refine hypotheses (K, 4, 4) of the true pose of points (N, 3); a weight of 0 marks those that only fill up.

    Errors are those of the truth of samples, or up to symmetry, which a symmetric target that slid along itself fails.
    """
    possible = np.flatnonzero(weight_K > 0)
    possible = possible[np.argsort(-weight_K[possible], kind="stable")]
    T_k = refine(observed, T_K[possible])
    rows = hypotheses.distinct_rows(surface, T_k, len(T_k), hypotheses.SAME / 2)
    apart_k_n = np.stack([surface.apart(T_k @ inverse(T_k[row])) for row in rows], axis=1)
    weight_n = np.bincount(apart_k_n.argmin(axis=1), weight_K[possible], minlength=len(rows))
    T_n = np.concatenate([T_registered[None], T_k[rows]])
    true_poses = TruePoses.of(observed, surface, T_K, weight_K, up_to_symmetry)
    distance_n_K, weight_n_K = true_poses.errors(T_n)
    weight_n_K[0] = np.append(weight_K, 0.0)  # as any judge of results has it
    fitness_n, rmse_n = measure(T_n)
    return Proposals(T_n, np.append(0.0, weight_n), Evidence(distance_n_K, weight_n_K, rmse_n, fitness_n), true_poses)


@dataclass(frozen=True)
class TruePoses:
    """Hypotheses that may be true, and an estimate by another criterion, as refined poses agree with theirs."""

    whole: ModelSurface  # measures errors: completed by what was observed under the likeliest hypothesis
    T_k: np.ndarray  # (k, 4, 4)
    weight_k: np.ndarray  # probabilities
    up_to_symmetry: bool = False

    @classmethod
    def of(
        cls, observed: np.ndarray, surface: ModelSurface, T_K: np.ndarray, weight_K: np.ndarray, up_to_symmetry: bool
    ) -> TruePoses:
        """Return hypotheses (K, 4, 4) of the true pose of observed points (N, 3), and the other estimate."""
        whole = Stayed(T_K[int(np.argmax(weight_K))], observed, surface).whole_surface()
        T_k = np.concatenate([T_K, best_end(observed, surface)[None]])
        return cls(whole, T_k, np.append((1 - OF_ESTIMATE) * weight_K, OF_ESTIMATE), up_to_symmetry)

    def errors(self, T_n: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return errors (n, k) of poses (n, 4, 4), and how probable each error is."""
        back_k = inverses(self.T_k)
        of = self.whole.errors_up_to_symmetry if self.up_to_symmetry else self.whole.errors
        # The other estimate is so rough that along a symmetric shape it says little.
        distance_n_k = np.array([[*of(T @ back_k[:-1]), *self.whole.errors(T @ back_k[-1:])] for T in T_n])
        return distance_n_k, np.tile(self.weight_k, (len(T_n), 1))


def best_end(observed: np.ndarray, surface: ModelSurface) -> np.ndarray:
    """Return the pose (4, 4) with the least cost at which ICP from many starts ends, on few points and then on all."""
    points = observed[generator("repair", "starts").permutation(len(observed))[: len(surface.points)]]
    some, some_model, icp = points[:SWEPT], surface.points[:SWEPT_MODEL], ICPSettings()

    def ends(points: np.ndarray, model: np.ndarray, starts_n: np.ndarray) -> np.ndarray:
        T_n, fitness_n, rmse_n = BatchedICP(model, icp).register(points, starts_n)
        return T_n[np.argsort(clipped_cost(fitness_n, rmse_n, icp.correspondence_distance), kind="stable")]

    swept_n = ends(some, some_model, hypotheses.search_starts(some, some_model))
    return ends(points, surface.points, swept_n[:CONTINUED])[0]


def unrefined(observed: np.ndarray, T_k: np.ndarray) -> np.ndarray:
    return T_k


def by_mixture(model: np.ndarray, spacing: float) -> Refine:
    """Return what refines poses to a model (M, 3) by the likelihood of the hypotheses; outliers hardly count."""
    mixture = Mixture(model, spacing / 2)

    def refine(observed: np.ndarray, T_k: np.ndarray) -> np.ndarray:
        densities = densities_of(observed, model)
        width_k = mixture.fit(observed, T_k, hypotheses.LAST_ITERATIONS, moving=False, densities=densities).width_n
        return mixture.fit(observed, T_k, hypotheses.LAST_ITERATIONS, width_n=width_k, densities=densities).T_n

    return refine


def by_method(model: np.ndarray, surface: ModelSurface, name: str, seed: int) -> Refine:
    """Return what refines poses to a model (M, 3) by a method, without outliers; where it fails, they stay."""
    method = make_method(name)

    def refine(observed: np.ndarray, T_k: np.ndarray) -> np.ndarray:
        pairs = zip(inliers(observed, surface, T_k), T_k, strict=True)
        pairs_k = (Pair(observed[inlier_N], model, T, seed=seed).with_normals() for inlier_N, T in pairs)
        return np.array([method(pair).T_target_source for pair in pairs_k])

    return refine


def measured(observed: np.ndarray, model: np.ndarray, icp: ICPSettings, moved: Moved) -> Measure:
    if moved == MODEL:
        return lambda T_n: icp_to(observed, icp).register(model, inverses(T_n), max_iterations=0)[1:]
    return lambda T_n: icp_to(model, icp).register(observed, T_n, max_iterations=0)[1:]


def search(pair: ObservedPair, settings: ReenactmentSettings, surface: ModelSurface) -> tuple[np.ndarray, np.ndarray]:
    """Return the hypotheses (K, 4, 4) of a pair's true pose, as a re-enactment has them, and their weights."""
    before, T_runs_n = transform(pair.T_init, pair.observed), pair.T_runs @ inverse(pair.T_init)
    candidates = hypotheses.find_hypotheses(before, surface, T_runs_n, settings, generator(*pair.axes, "hypotheses"))
    return np.array([hypothesis.T for hypothesis in candidates]), hypotheses.weights_of(candidates)


def decide(
    judge: ResultJudge,
    level: Calibrated,
    proposals: Proposals,
    tolerance: float,
    lost: bool = False,
    described_F: np.ndarray | None = None,
) -> Verdict:
    """Return the verdict (docs/repair.md); a `lost` pose, away from the target, never stays."""

    def of_set(rows: list[int]) -> float:
        """Return how probably all of these poses, which fit as the first of them does, are off."""
        distance_1_K = proposals.evidence.distance_N_K[rows].min(axis=0, keepdims=True)
        evidence = replace(proposals.evidence.subset(np.array(rows[:1])), distance_N_K=distance_1_K)
        return float(judge.probability(evidence, tolerance)[0])

    probability_n = judge.probability(proposals.evidence, tolerance)
    if described_F is not None:
        registered = proposals.evidence.subset(np.array([0]))
        probability_n[:1] = judge.probability(registered, tolerance, described_F[None])
    failed_from = 0.0 if lost else level.threshold
    return verdict_of(probability_n, proposals.weight_n, failed_from, level.good_below, of_set)


def verdict_of(
    probability_n: np.ndarray,
    weight_n: np.ndarray,
    failed_from: float,
    good_below: float,
    of_set: Callable[[list[int]], float],
) -> Verdict:
    """Judge the first pose and others, of these weights, by how probably each, or all of some rows, is off."""
    if probability_n[0] < failed_from:
        return Verdict(GOOD, 0, (), probability_n)
    best = 1 + int(probability_n[1:].argmin()) if len(probability_n) > 1 else 0
    if best and probability_n[best] < good_below:
        return Verdict(REPAIRED, best, (), probability_n)
    offered = [row for row in np.argsort(-weight_n, kind="stable").tolist() if row and weight_n[row] >= LEAST_WEIGHT]
    for count in range(2, len(offered) + 1):
        if of_set(offered[:count]) < good_below:
            return Verdict(SEVERAL, 0, tuple(offered[:count]), probability_n)
    return Verdict(NOT_REPAIRED, 0, (), probability_n)


def inliers(points: np.ndarray, surface: ModelSurface, T_K: np.ndarray) -> np.ndarray:
    """Return which points (K, N) lie on the surface at poses (K, 4, 4); all, where next to none would be left."""
    inlier_K_N = hypotheses.fits_at(T_K, points, surface).inlier_n_N > 0.5
    return inlier_K_N | (inlier_K_N.sum(axis=1) < hypotheses.FEWEST_INLIERS)[:, None]


@dataclass(frozen=True)
class Part:
    """A part of the target's surface."""

    direction: tuple[float, ...]  # (3,) unit vector from the middle of the surface to that of the part
    share: float  # of the surface

    @classmethod
    def of(cls, surface: ModelSurface, inside_M: np.ndarray) -> Part:
        """Describe which points (M,) of the surface belong to it."""
        away = surface.points[inside_M].mean(axis=0) - surface.points.mean(axis=0)
        return cls(tuple((away / max(np.linalg.norm(away), 1e-9)).tolist()), float(inside_M.mean()))


def difference(surface: ModelSurface, T_one: np.ndarray, T_other: np.ndarray) -> tuple[Part, float]:
    """Return what tells two poses apart: where one has surface, and how far from it the other has its own."""
    distance_M = surface.distances(transform(T_other @ inverse(T_one), surface.points))
    inside_M = distance_M >= LARGE * distance_M.max()
    return Part.of(surface, inside_M), float(distance_M[inside_M].mean())


def unseen(points: np.ndarray, surface: ModelSurface, T: np.ndarray) -> tuple[float, Part | None]:
    """Return the share of outliers among points (N, 3) at a pose, and the part of the surface they leave out."""
    observation = Stayed(T, points, surface).observation()
    missing_M = ~observation.covered
    return observation.outliers, Part.of(surface, missing_M) if missing_M.any() else None
