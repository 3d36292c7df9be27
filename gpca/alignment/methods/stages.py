"""ICP as a sequence of exchangeable stages (Rusinkiewicz & Levoy 2001): select, match, reject, weigh, minimize."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from gpca.alignment.icp import CONVERGED
from gpca.alignment.methods.interface import FEWEST, FailedRegistration, Pair, failure_of_a_step
from gpca.alignment.rigid import best_motion, plane_step, rotate, transform

Metric = Literal["point_to_point", "point_to_plane"]
ROUNDING = 1 + 1e-9  # the tree may sum a square in another order


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

    def kept(self, keep_n: np.ndarray) -> Matches:
        """Return the matches of a mask or of rows."""
        arrays = ("source_rows", "source", "rows", "distance")
        return replace(self, **{name: getattr(self, name)[keep_n] for name in arrays})

    def farthest_at(self, T_target_source: np.ndarray) -> float:
        """Return the largest distance of the same matches at another pose."""
        offset_n_3 = transform(T_target_source, self.pair.source[self.source_rows]) - self.pair.target[self.rows]
        return float(np.sqrt(np.square(offset_n_3).sum(axis=1).max()))

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
        reject: from matches to the kept matches.
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
        """Return the kept matches at a pose; fewer than three are a failure.

        Matches at the previous pose only bound the search radius.
        """
        rows_n = np.arange(len(pair.source)) if self.rows is None else self.rows
        source_n_3 = transform(T_target_source, pair.source[rows_n])
        reach = self.distance if before is None else min(self.distance, before.farthest_at(T_target_source))
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
        if share < CONVERGED and abs(_rmse(matches) - _rmse(before)) < CONVERGED:
            break
    return T, matches, failure_of_a_step(pair, T, stages.step(matches) @ T, max_iterations)


def nearest(distance_n: np.ndarray, count: int) -> np.ndarray:
    """Return the sorted rows of the `count` smallest distances, at least one."""
    return np.sort(np.argsort(distance_n, kind="stable")[: max(1, count)])


def _rmse(matches: Matches) -> float:
    return float(np.sqrt(np.square(matches.distance).mean()))
