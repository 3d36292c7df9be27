"""The variants of ICP that Rusinkiewicz & Levoy (2001) compare: sampling, rejection, weighting, one at a time.

All minimize distances to planes, as theirs. Normals of both clouds have to point to the same side of the surface
(:func:`gpca.alignment.features.estimate_normals`).
"""

from __future__ import annotations

from functools import partial
from typing import Annotated, Literal

import numpy as np

from gpca.alignment.methods.interface import CORRESPONDENCE_DISTANCE, MAX_ITERATIONS, MethodEntry, Outcome, Pair
from gpca.alignment.methods.stages import Matches, Metric, Stages, nearest, run_stages
from gpca.seeds import generator
from gpca.settings import Bounds, PositiveShare

Sampling = Literal["all", "random", "normal_space"]
Criterion = Literal["none", "distance", "normals", "trimming"]
Weighting = Literal["none", "distance", "normals"]
DIRECTIONS = 64  # bins of normals, evenly on the sphere: about 25 degrees apart


def align(
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
    stages = Stages(
        rows=_sample(pair, sampling, sampled),
        reject=partial(_reject, criterion=rejection, deviations=deviations, angle_deg=angle_deg, worst=worst),
        weigh=partial(_weigh, weighting=weighting),
        metric=metric,
        distance=correspondence_distance,
    )
    T, _, failure = run_stages(pair, stages, max_iterations)
    return Outcome.at(pair, T, correspondence_distance, failure)


def _sample(pair: Pair, sampling: Sampling, share: float) -> np.ndarray | None:
    if sampling == "all":
        return None
    random, points = generator("sampling", sampling, pair.seed), len(pair.source)
    order_N = random.permutation(points)
    if sampling == "normal_space":
        # One point of each direction in turn, so that flat parts get no more than others.
        direction_N = _direction(pair.normals("source"))[order_N]
        by_direction_N = np.argsort(direction_N, kind="stable")
        sizes_D = np.bincount(direction_N, minlength=DIRECTIONS)
        turn_N = np.empty(points, np.int64)
        turn_N[by_direction_N] = np.arange(points) - np.repeat(np.cumsum(sizes_D) - sizes_D, sizes_D)
        order_N = order_N[np.argsort(turn_N, kind="stable")]
    return np.sort(order_N[: max(1, round(share * points))])


def _direction(normals_N_3: np.ndarray) -> np.ndarray:
    """Index (N,) of the nearest of `DIRECTIONS` directions on a Fibonacci spiral."""
    d_D = np.arange(DIRECTIONS) + 0.5
    polar_D, azimuth_D = np.arccos(1 - 2 * d_D / DIRECTIONS), np.pi * (1 + 5**0.5) * d_D
    directions_D_3 = np.stack(
        [np.cos(azimuth_D) * np.sin(polar_D), np.sin(azimuth_D) * np.sin(polar_D), np.cos(polar_D)], axis=1
    )
    return np.einsum("ni,di->nd", normals_N_3, directions_D_3).argmax(axis=1)


def _reject(matches: Matches, criterion: Criterion, deviations: float, angle_deg: float, worst: float) -> Matches:
    distance_n = matches.distance
    if criterion == "distance" and len(distance_n):
        return matches.kept(distance_n <= distance_n.mean() + deviations * distance_n.std())
    if criterion == "normals":
        return matches.kept(matches.cosines() >= np.cos(np.deg2rad(angle_deg)))
    if criterion == "trimming":
        return matches.kept(nearest(distance_n, round((1 - worst) * len(distance_n))))
    return matches


def _weigh(matches: Matches, weighting: Weighting) -> np.ndarray:
    if weighting == "distance":
        return 1 - matches.distance / matches.limit
    if weighting == "normals":
        return np.clip(matches.cosines(), 0, 1)
    return np.ones(len(matches.distance))


METHODS = {
    "random_sampling": MethodEntry("ICP, random sampling", partial(align, sampling="random")),
    "normal_space": MethodEntry("ICP, normal-space sampling", partial(align, sampling="normal_space")),
    "reject_distance": MethodEntry("ICP, rejection by distance", partial(align, rejection="distance")),
    "reject_normals": MethodEntry("ICP, rejection by normals", partial(align, rejection="normals")),
    "reject_worst": MethodEntry("ICP, rejection of the worst", partial(align, rejection="trimming")),
    "weight_distance": MethodEntry("ICP, weights by distance", partial(align, weighting="distance")),
    "weight_normals": MethodEntry("ICP, weights by normals", partial(align, weighting="normals")),
}
