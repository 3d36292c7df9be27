"""Interventions on a pair whose uncertainty answers: perturbations as knobs, and remedies as switches.

The uncertainty is a function f(noise, spread, overlap) of the knobs (Qin et al. 2024); jitter, direction of the cut and
starts are drawn once per pair. A remedy that lowers the uncertainty points to the cause.
"""

from dataclasses import replace
from functools import cache
from time import perf_counter
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.batched_icp import AnyICP, icp_to
from gpca.pairs.perturbation import within_half_space
from gpca.rigid import random_direction, transform
from gpca.uncertainty.settings import Remedies, UncertaintySettings
from gpca.uncertainty.spread import Runs, Spread, run_from_starts, summarize_runs


class Knobs(NamedTuple):
    """Setting of the three features, in the order of the concepts noise, pose, overlap."""

    noise: float = 0.0  # standard deviation of the jitter added to the source, relative to the diameter
    spread: float = 1.0  # factor on the spread of the initial poses
    overlap: float = 0.0  # share of the source's points that is cut off


UNTOUCHED = Knobs()
# The middle of the severities: 2 % noise; starts 37.5° and 19 % of the diameter off, not 10° and 5 %; 40 % cut off.
MIDDLE = Knobs(0.02, 3.75, 0.40)
UPPER = Knobs(0.03, 6.0, 0.60)  # their upper ends: 3 %, 60°, 60 %
FEWEST_LEFT = 3  # that a cut leaves


class KnobbedSource:
    """A source cloud (N, 3), in diameters, under any setting of noise and overlap, drawn once."""

    def __init__(self, source: np.ndarray, random: np.random.Generator) -> None:
        self._source = source
        self._jitter = random.normal(size=source.shape)
        self._along = source @ random_direction(random)

    def at(self, knobs: Knobs) -> np.ndarray:
        """Return the points (n, 3) that are left, with their jitter."""
        kept = within_half_space(self._along, knobs.overlap, FEWEST_LEFT)
        return (self._source + knobs.noise * self._jitter)[kept]


# Source (N, 3) and target (Q, 3) of a pair, in diameters, each in its own frame; its initial pose and the reference
# pose, from which the spread is measured.
Clouds = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


class PairDraws(NamedTuple):
    """What all runs of one pair share."""

    xi_n_6: np.ndarray  # twists of the starts
    settings: UncertaintySettings
    random: np.random.Generator  # of all else


class KnobRuns:
    """The function f of one pair; a setting that was evaluated is not evaluated again."""

    def __init__(self, clouds: Clouds, draws: PairDraws) -> None:
        source, self._target, self._T_init, self.T_ref = clouds
        self._xi_n_6, self._settings, random = draws
        self._source = KnobbedSource(source, random)
        self._icp = icp_to(self._target, self._settings.icp)
        self._seen: dict[Knobs, Spread] = {}

    def __call__(self, knobs: Knobs) -> Spread:
        """Evaluate one setting; the outcome of one seen before costs nothing."""
        if knobs in self._seen:
            return replace(self._seen[knobs], icp_calls=0, icp_seconds=0.0, seconds=0.0)
        started = perf_counter()
        runs, source = self.runs(knobs)
        spread = summarize_runs(runs, cKDTree(source), self._target, self.T_ref, self._settings, started)
        self._seen[knobs] = spread
        return spread

    def runs(self, knobs: Knobs) -> tuple[Runs, np.ndarray]:
        """Run ICP from all starts under one setting, seen before or not; return the runs and the source (N, 3)."""
        source = self._source.at(knobs)
        return run_from_starts(self._icp, source, self._T_init, knobs.spread * self._xi_n_6), source


NEIGHBORS = 24  # so many span the plane that a point is moved to
OUTLIER_RATIO = 2.0  # standard deviations beyond the mean neighbor distance
BROADER = 3.75  # spread of the restarts, in that of the other starts: the middle of the pose severities
RESTARTS = 5  # the one with the lowest cost counts
FEWEST_TRIMMED = 16  # where a trimmed target would have fewer, nothing is trimmed


class RemedyRuns:
    """Runs of one observed pair under every combination of remedies; the reference pose is that of ICP."""

    def __init__(self, clouds: Clouds, draws: PairDraws) -> None:
        source, self._target, self._T_init, self._T_icp = clouds
        self._xi_n_6, self._settings, random = draws
        self._observed = source[random.permutation(len(source))]
        self._source, self._seen = cache(self._with_tree), cache(self._with_icp)  # whether denoised; whether trimmed

    def __call__(self, remedies: Remedies) -> Spread:
        """Evaluate one combination; work that several share is done, and charged, once."""
        started = perf_counter()
        (tree, points), (icp, target) = self._source(remedies.denoise), self._seen(remedies.trim)
        xi_n_6 = BROADER * self._xi_n_6 if remedies.restart else self._xi_n_6
        runs = run_from_starts(icp, points[: self._settings.icp_points], self._T_init, xi_n_6)
        if remedies.restart:
            runs = best_of_neighbors(runs, self._settings.icp.correspondence_distance)
        return summarize_runs(runs, tree, target, self._T_icp, self._settings, started)

    def _with_tree(self, denoised: bool) -> tuple[cKDTree, np.ndarray]:
        points = denoise(self._observed) if denoised else self._observed
        return cKDTree(points), points

    def _with_icp(self, trimmed: bool) -> tuple[AnyICP, np.ndarray]:
        target, icp = self._target, self._settings.icp
        if trimmed:
            target = trim(target, transform(self._T_icp, self._observed), icp.correspondence_distance)
        return icp_to(target[: self._settings.icp_points], icp), target


def denoise(points: np.ndarray) -> np.ndarray:
    """Remove statistical outliers (Rusu et al. 2008); move others to planes of neighbors (MLS, Alexa et al. 2003)."""
    neighbors = min(NEIGHBORS, len(points))
    distances, rows = cKDTree(points).query(points, neighbors)
    mean_N = distances.mean(axis=1)
    kept = mean_N <= mean_N.mean() + OUTLIER_RATIO * mean_N.std()
    around_N_k_3 = points[rows[kept]]
    center_N_3 = around_N_k_3.mean(axis=1)
    offset_N_k_3 = around_N_k_3 - center_N_3[:, None]
    normal_N_3 = np.linalg.eigh(np.swapaxes(offset_N_k_3, 1, 2) @ offset_N_k_3)[1][:, :, 0]
    height_N = np.einsum("ni,ni->n", points[kept] - center_N_3, normal_N_3)
    return points[kept] - height_N[:, None] * normal_N_3


def trim(target: np.ndarray, aligned_source: np.ndarray, distance: float) -> np.ndarray:
    """Return the target's points within `distance` of the aligned source; all where hardly any are."""
    kept = cKDTree(aligned_source).query(target, distance_upper_bound=distance)[0] < distance
    return target[kept] if kept.sum() >= FEWEST_TRIMMED else target


def best_of_neighbors(runs: Runs, distance: float) -> Runs:
    """Replace every run by the best of itself and the next ones, as if each result had come from `RESTARTS` starts."""
    cost_n = runs.cost_n(distance)
    rows_n_k = (np.arange(len(cost_n))[:, None] + np.arange(RESTARTS)) % len(cost_n)
    return runs.chosen(rows_n_k[np.arange(len(cost_n)), cost_n[rows_n_k].argmin(axis=1)])
