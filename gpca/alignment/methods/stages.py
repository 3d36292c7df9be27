"""ICP as a sequence of exchangeable stages: select, match, reject, weigh, minimize; variants of it, and trimmed ICP.

The variants are those that Rusinkiewicz & Levoy (2001) compare, one stage at a time: sampling, rejection, weighting.
All minimize distances to planes, as theirs. Normals of both clouds have to point to the same side of the surface
(:func:`gpca.alignment.features.estimate_normals`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Annotated, Literal

import numpy as np

from gpca.alignment.icp import CONVERGED
from gpca.alignment.methods.interface import (
    CORRESPONDENCE_DISTANCE,
    FEWEST,
    MAX_ITERATIONS,
    FailedRegistration,
    MethodEntry,
    Outcome,
    Pair,
)
from gpca.alignment.methods.local import failure_of_a_step
from gpca.alignment.rigid import best_motion, plane_step, rotate, transform
from gpca.seeds import generator
from gpca.settings import Bounds, PositiveShare, Share

Metric = Literal["point_to_point", "point_to_plane"]
Sampling = Literal["all", "random", "normal_space"]
Criterion = Literal["none", "distance", "normals", "trimming"]
Weighting = Literal["none", "distance", "normals"]
ROUNDING = 1 + 1e-9  # the tree may sum a square in another order
DIRECTIONS = 64  # bins of normals, evenly on the sphere: about 25 degrees apart
LEAST_OVERLAP = 0.4  # lower end of the search for the overlap, as in the paper of trimmed ICP
EXPONENT = 2.0  # λ of that paper, the preference for a larger overlap


@dataclass(frozen=True)
class Matches:
    """Source points (n, 3) at a pose, each with its nearest target point.

    Attributes:
        source_rows, rows: (n,) of source and target.
        distance: (n,) between the two.
        limit: of the distances.
    """

    pair: Pair
    T_target_source: np.ndarray
    source_rows: np.ndarray
    source: np.ndarray
    rows: np.ndarray
    distance: np.ndarray
    limit: float

    @property
    def rmse(self) -> float:
        """Root mean square of the distances."""
        return float(np.sqrt(np.square(self.distance).mean()))

    def kept(self, keep_n: np.ndarray) -> Matches:
        """Return the matches of a mask or of rows."""
        arrays = ("source_rows", "source", "rows", "distance")
        return replace(self, **{name: getattr(self, name)[keep_n] for name in arrays})

    def cosines(self) -> np.ndarray:
        """Return the cosines (n,) of the angles between the normals of the two points."""
        source_n_3 = rotate(self.T_target_source, self.pair.normals("source")[self.source_rows])
        return np.einsum("ni,ni->n", source_n_3, self.pair.normals("target")[self.rows])


@dataclass(frozen=True)
class Stages:
    """The exchangeable stages; the defaults are plain ICP.

    Attributes:
        rows: participating source points, or None for all.
        share: of the source's points, those with the smallest distances, that are kept.
        weigh: from matches to their weights (n,).
        metric: the minimized distance.
        distance: farther points are no match.
    """

    rows: np.ndarray | None = None
    share: float = 1.0
    reject: Callable[[Matches], Matches] = lambda matches: matches
    weigh: Callable[[Matches], np.ndarray] = lambda matches: np.ones(len(matches.distance))
    metric: Metric = "point_to_point"
    distance: float = np.inf

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
        normals_n_3 = matches.pair.normals("target")[matches.rows]
        return plane_step(matches.source, target_n_3, normals_n_3, weights_n)


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
    pair: Pair,
    overlap: Share = 0.0,
    correspondence_distance: float = CORRESPONDENCE_DISTANCE,
    max_iterations: int = MAX_ITERATIONS,
) -> Outcome:
    """Align the share `overlap` of the source that fits best; with 0, find that share ξ too (Chetverikov et al. 2002).

    The minimized objective is ψ(ξ) = e / ξ^(1+λ), e the mean square of the trimmed distances. `correspondence_distance`
    does not limit correspondences; it only measures the outcome.
    """

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
    pair: Pair,
    sampling: Sampling = "all",
    rejection: Criterion = "none",
    weighting: Weighting = "none",
    metric: Metric = "point_to_plane",
    sampled: PositiveShare = 0.5,
    deviations: float = 2.5,
    angle_deg: Annotated[float, Bounds(minimum=0, maximum=180)] = 45.0,
    worst: Annotated[float, Bounds(minimum=0, exclusiveMaximum=1)] = 0.1,
    correspondence_distance: float = CORRESPONDENCE_DISTANCE,
    max_iterations: int = MAX_ITERATIONS,
) -> Outcome:
    """Run one variant; without sampling, rejection and weighting it is plain ICP.

    Args:
        sampling: random, or even over the directions of the normals; drawn once per pair.
        rejection: of distances more than `deviations` standard deviations above their mean (Masuda 1996), of normals
            at an angle above `angle_deg`, or of the `worst` share (Pulli 1999).
        weighting: 1 - d / d_max (Godin 1994), or the cosine between the normals.
        sampled: share of the source's points.
    """
    rows = None if sampling == "all" else sample(pair, sampling, sampled)
    stages = Stages(
        rows=rows,
        reject=partial(reject, criterion=rejection, deviations=deviations, angle_deg=angle_deg, worst=worst),
        weigh=partial(weigh, weighting=weighting),
        metric=metric,
        distance=correspondence_distance,
    )
    T, _, failure = run_stages(pair, stages, max_iterations)
    return Outcome.at(pair, T, correspondence_distance, failure)


def sample(pair: Pair, sampling: Sampling, share: float) -> np.ndarray:
    """Return the rows of a share of the source's points, at random or evenly over the directions of their normals.

    Evenly means one point of each direction in turn, so that flat parts get no more than others. The directions are on
    a Fibonacci spiral; each normal counts to the nearest.
    """
    random, points = generator("sampling", sampling, pair.seed), len(pair.source)
    order_N = random.permutation(points)
    if sampling == "normal_space":
        d_D = np.arange(DIRECTIONS) + 0.5
        polar_D, azimuth_D = np.arccos(1 - 2 * d_D / DIRECTIONS), np.pi * (1 + 5**0.5) * d_D
        x_D, y_D, z_D = np.cos(azimuth_D) * np.sin(polar_D), np.sin(azimuth_D) * np.sin(polar_D), np.cos(polar_D)
        cosines_N_D = np.einsum("ni,di->nd", pair.normals("source"), np.stack([x_D, y_D, z_D], axis=1))
        direction_N = cosines_N_D.argmax(axis=1)[order_N]
        sizes_D = np.bincount(direction_N, minlength=DIRECTIONS)
        turn_N = np.empty(points, np.int64)
        turn_N[np.argsort(direction_N, kind="stable")] = np.arange(points) - np.repeat(
            np.cumsum(sizes_D) - sizes_D, sizes_D
        )
        order_N = order_N[np.argsort(turn_N, kind="stable")]
    return np.sort(order_N[: max(1, round(share * points))])


def reject(matches: Matches, criterion: Criterion, deviations: float, angle_deg: float, worst: float) -> Matches:
    """Return the matches that a criterion keeps."""
    distance_n = matches.distance
    if criterion == "distance" and len(distance_n):
        return matches.kept(distance_n <= distance_n.mean() + deviations * distance_n.std())
    if criterion == "normals":
        return matches.kept(matches.cosines() >= np.cos(np.deg2rad(angle_deg)))
    if criterion == "trimming":
        return matches.kept(nearest(distance_n, round((1 - worst) * len(distance_n))))
    return matches


def weigh(matches: Matches, weighting: Weighting) -> np.ndarray:
    """Return the weights (n,) of the matches."""
    if weighting == "distance":
        return 1 - matches.distance / matches.limit
    return np.clip(matches.cosines(), 0, 1) if weighting == "normals" else np.ones(len(matches.distance))


METHODS = {
    "trimmed": MethodEntry("Trimmed ICP", align_trimmed),
    "random_sampling": MethodEntry("ICP, random sampling", partial(align_variant, sampling="random")),
    "normal_space": MethodEntry("ICP, normal-space sampling", partial(align_variant, sampling="normal_space")),
    "reject_distance": MethodEntry("ICP, rejection by distance", partial(align_variant, rejection="distance")),
    "reject_normals": MethodEntry("ICP, rejection by normals", partial(align_variant, rejection="normals")),
    "reject_worst": MethodEntry("ICP, rejection of the worst", partial(align_variant, rejection="trimming")),
    "weight_distance": MethodEntry("ICP, weights by distance", partial(align_variant, weighting="distance")),
    "weight_normals": MethodEntry("ICP, weights by normals", partial(align_variant, weighting="normals")),
}
