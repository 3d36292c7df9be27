"""ICP as exchangeable stages, variants of one stage at a time (Rusinkiewicz & Levoy 2001), and trimmed ICP."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any, Literal, Self

import numpy as np

from gpca.alignment.icp import CONVERGED
from gpca.alignment.methods.interface import FEWEST, ITERATIONS, REACH, FailedRegistration, MethodEntry, Outcome, Pair
from gpca.alignment.methods.local import failure_of_a_step
from gpca.rigid import best_motion, plane_step, rotate, transform
from gpca.seeds import generator
from gpca.settings import Share

Metric = Literal["point_to_point", "point_to_plane"]
ROUNDING = 1 + 1e-9  # the tree may sum a square in another order
SAMPLED = 0.5  # share of the source's points
DIRECTIONS = 64  # bins of normals, evenly on the sphere: about 25 degrees apart
DEVIATIONS = 2.5  # standard deviations above the mean, beyond which a distance is rejected (Masuda 1996)
LEAST_COSINE = np.cos(np.deg2rad(45.0))  # of the angle between the normals of a pair that is kept
WORST = 0.1  # share of the pairs that is rejected (Pulli 1999)
LEAST_OVERLAP = 0.4  # lower end of the search for the overlap, as in the paper of trimmed ICP
EXPONENT = 2.0  # λ of that paper, the preference for a larger overlap


@dataclass(frozen=True)
class Matches:
    """Source points (n, 3) at a pose, each with its nearest target point."""

    pair: Pair
    T_target_source: np.ndarray
    source_rows: np.ndarray  # (n,)
    source: np.ndarray
    rows: np.ndarray  # (n,) of the target
    distance: np.ndarray  # (n,) between the two
    limit: float  # of the distances

    @property
    def rmse(self) -> float:
        """Root mean square of the distances."""
        return float(np.sqrt(np.square(self.distance).mean()))

    def kept(self, keep_n: np.ndarray) -> Self:
        """Return the matches of a mask or of rows."""
        arrays = ("source_rows", "source", "rows", "distance")
        return replace(self, **{name: getattr(self, name)[keep_n] for name in arrays})

    def cosines(self) -> np.ndarray:
        """Return the cosines (n,) of the angles between the normals of the two points."""
        source_n_3 = rotate(self.T_target_source, self.pair.normals("source")[self.source_rows])
        return np.einsum("ni,ni->n", source_n_3, self.pair.normals("target")[self.rows])


@dataclass(frozen=True)
class Stages:
    """The exchangeable stages; the defaults are plain ICP."""

    rows: np.ndarray | None = None  # participating source points, or None for all
    share: float = 1.0  # of the source's points, those with the smallest distances, that are kept
    reject: Callable[[Matches], Matches] = lambda matches: matches
    weigh: Callable[[Matches], np.ndarray] = lambda matches: np.ones(len(matches.distance))
    metric: Metric = "point_to_point"
    distance: float = np.inf  # farther points are no match

    def match(self, pair: Pair, T_target_source: np.ndarray, before: Matches | None = None) -> Matches:
        """Return the kept matches at a pose; those at the previous pose only bound the search radius."""
        rows_n = np.arange(len(pair.source)) if self.rows is None else self.rows
        source_n_3 = transform(T_target_source, pair.source[rows_n])
        reach = self.distance
        if before is not None:
            offset_n_3 = transform(T_target_source, pair.source[before.source_rows]) - pair.target[before.rows]
            reach = min(reach, float(np.sqrt(np.square(offset_n_3).sum(axis=1).max())))
        distance_n, target_rows_n = pair.target_tree.query(source_n_3, distance_upper_bound=reach * ROUNDING)
        nearby = Matches(pair, T_target_source, rows_n, source_n_3, target_rows_n, distance_n, self.distance)
        near = nearby.kept(distance_n < self.distance)
        if self.share < 1:
            near = near.kept(nearest(near.distance, round(self.share * len(rows_n))))
        matches = self.reject(near)
        if len(matches.distance) < FEWEST:
            raise FailedRegistration(f"fewer than {FEWEST} correspondences are left")
        return matches

    def step(self, matches: Matches) -> np.ndarray:
        """Return the motion (4×4) that minimizes the metric over the matches."""
        weights_n = self.weigh(matches)
        if not weights_n.any():
            raise FailedRegistration("no correspondence has any weight")
        target_n_3 = matches.pair.target[matches.rows]
        if self.metric == "point_to_point":
            return best_motion(matches.source, target_n_3, weights_n)
        return plane_step(matches.source, target_n_3, matches.pair.normals("target")[matches.rows], weights_n)


def run_stages(pair: Pair, stages: Stages, max_iterations: int) -> tuple[np.ndarray, Matches, str]:
    """Iterate until the share of matches and their RMSE converge, as in Open3D: the pose, its matches, any failure."""
    T = np.array(pair.T_target_source_init, np.float64)
    matches = stages.match(pair, T)
    for _ in range(max_iterations):
        before, T = matches, stages.step(matches) @ T
        matches = stages.match(pair, T, before if stages.share < 1 else None)
        share = abs(len(matches.distance) - len(before.distance)) / len(pair.source)
        if share < CONVERGED and abs(matches.rmse - before.rmse) < CONVERGED:
            break
    return T, matches, failure_of_a_step(pair, T, stages.step(matches) @ T, max_iterations)


def nearest(distance_n: np.ndarray, count: int) -> np.ndarray:
    """Return the sorted rows of the `count` smallest distances, at least one."""
    return np.sort(np.argsort(distance_n, kind="stable")[: max(1, count)])


def align_trimmed(
    pair: Pair, overlap: Share = 0.0, correspondence_distance: float = REACH, max_iterations: int = ITERATIONS
) -> Outcome:
    """Align the share that fits best, or find it by ψ(ξ) = e / ξ^(1+λ), e the mean square (Chetverikov et al. 2002)."""

    @cache
    def run(share: float) -> tuple[np.ndarray, Matches, str]:
        return run_stages(pair, Stages(share=share), max_iterations)

    def objective(share: float) -> float:
        return float(np.square(run(share)[1].distance).mean()) / share ** (1 + EXPONENT)

    if not overlap:
        from scipy.optimize import minimize_scalar

        bounds, options = (LEAST_OVERLAP, 1.0), {"xatol": 0.02, "maxiter": 12}
        overlap = minimize_scalar(objective, bounds=bounds, method="bounded", options=options).x
    T, _, failure = run(overlap)
    return Outcome.at(pair, T, correspondence_distance, failure)


def align_variant(
    stage: str, change: Callable, pair: Pair, correspondence_distance: float = REACH, max_iterations: int = ITERATIONS
) -> Outcome:
    """Run point-to-plane ICP with one stage changed; rows are drawn once per pair."""
    changed: dict[str, Any] = {stage: change(pair) if stage == "rows" else change}
    stages = Stages(metric="point_to_plane", distance=correspondence_distance, **changed)
    T, _, failure = run_stages(pair, stages, max_iterations)
    return Outcome.at(pair, T, correspondence_distance, failure)


def sample_at_random(pair: Pair) -> np.ndarray:
    return _share_of(generator("sampling", "random", pair.seed).permutation(len(pair.source)))


def sample_normal_space(pair: Pair) -> np.ndarray:
    """Return rows of the source, one of each direction of normals in turn: flat parts get no more than others."""
    order_N = generator("sampling", "normal_space", pair.seed).permutation(len(pair.source))
    d_D = np.arange(DIRECTIONS) + 0.5
    polar_D, azimuth_D = np.arccos(1 - 2 * d_D / DIRECTIONS), np.pi * (1 + 5**0.5) * d_D
    x_D, y_D, z_D = np.cos(azimuth_D) * np.sin(polar_D), np.sin(azimuth_D) * np.sin(polar_D), np.cos(polar_D)
    cosines_N_D = np.einsum("ni,di->nd", pair.normals("source"), np.stack([x_D, y_D, z_D], axis=1))
    direction_N = cosines_N_D.argmax(axis=1)[order_N]
    sizes_D = np.bincount(direction_N, minlength=DIRECTIONS)
    first_N = np.repeat(np.cumsum(sizes_D) - sizes_D, sizes_D)
    turn_N = np.empty(len(order_N), np.int64)
    turn_N[np.argsort(direction_N, kind="stable")] = np.arange(len(order_N)) - first_N
    return _share_of(order_N[np.argsort(turn_N, kind="stable")])


def _share_of(order_N: np.ndarray) -> np.ndarray:
    return np.sort(order_N[: max(1, round(SAMPLED * len(order_N)))])


def reject_distance(matches: Matches) -> Matches:
    distance_n = matches.distance
    return matches.kept(distance_n <= distance_n.mean() + DEVIATIONS * distance_n.std()) if len(distance_n) else matches


def reject_worst(matches: Matches) -> Matches:
    return matches.kept(nearest(matches.distance, round((1 - WORST) * len(matches.distance))))


VARIANTS: dict[str, tuple[str, str, Callable]] = {  # title, and what one stage does instead
    "random_sampling": ("ICP, random sampling", "rows", sample_at_random),
    "normal_space": ("ICP, normal-space sampling", "rows", sample_normal_space),
    "reject_distance": ("ICP, rejection by distance", "reject", reject_distance),
    "reject_normals": ("ICP, rejection by normals", "reject", lambda of: of.kept(of.cosines() >= LEAST_COSINE)),
    "reject_worst": ("ICP, rejection of the worst", "reject", reject_worst),
    "weight_distance": ("ICP, weights by distance", "weigh", lambda of: 1 - of.distance / of.limit),  # Godin 1994
    "weight_normals": ("ICP, weights by normals", "weigh", lambda of: np.clip(of.cosines(), 0, 1)),
}
METHODS = {"trimmed": MethodEntry("Trimmed ICP", align_trimmed, points_only=True)} | {
    name: MethodEntry(title, partial(align_variant, stage, change)) for name, (title, stage, change) in VARIANTS.items()
}
