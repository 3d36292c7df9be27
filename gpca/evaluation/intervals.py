"""95 % intervals: by the pigeonhole bootstrap over clusters and seeds, Wilson's, and Student's over seeds.

The pigeonhole bootstrap (Owen 2007) draws clusters (families of objects, scenes, rendered tables) and seeds with
replacement and weights a sample by the product of the two counts. docs/comparison.md and docs/appendix.md state which
value has which interval, benchmarks/intervals.py checks their coverage.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from math import sqrt
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from gpca.seeds import generator

REPEATS = 500
LEVEL = 0.95
FEWEST_CLUSTERS = 5  # below which no difference is shown
FEWEST_FAILURES = 30  # or other samples of a kind, below which nothing is concluded
NO_WIDTH = 1e-9  # an interval this narrow differs from a point by rounding alone
ANYTHING = (-np.inf, np.inf)  # limits of a value that has none
GUESSES = ("chance", "most_frequent")
WITHOUT_TRAINING = (*GUESSES, "rule")
TRIVIAL = (*WITHOUT_TRAINING, "rule_fitted", "tree_trivial", "logistic_trivial", "density", "hypotheses")


def mean_ranks(values_N: np.ndarray) -> np.ndarray:
    """Return the ranks (N,) of scipy.stats, whose import takes a second; equal values share their mean."""
    if np.isnan(values_N).any():
        return np.full(len(values_N), np.nan)
    sorted_N = np.sort(values_N)
    return (np.searchsorted(sorted_N, values_N, "left") + np.searchsorted(sorted_N, values_N, "right") + 1) / 2


class Estimate(NamedTuple):
    """A value and the bounds of its 95 % interval, NaN where there is none."""

    value: float
    low: float
    high: float


def pigeonhole_weights(random: np.random.Generator, *factors: np.ndarray) -> np.ndarray:
    """Number of times that each of N samples is drawn, (`REPEATS`, N), by their levels of factors such as the seed."""
    weights_B_N = np.ones((REPEATS, len(factors[0])))
    for factor_N in factors:
        levels_K, number_N = np.unique(factor_N, return_inverse=True)
        share_K = np.full(len(levels_K), 1 / len(levels_K))
        weights_B_N *= random.multinomial(len(levels_K), share_K, size=REPEATS)[:, number_N]
    return weights_B_N


def interval(
    value_B: np.ndarray,
    drawn_B_N: np.ndarray | None = None,
    difference: bool = False,
    level: float = LEVEL,
    samples: int | None = None,
) -> Estimate:
    """Value and interval of a statistic (1 + B,) of the samples themselves, then of every draw; NaN where undefined.

    For a share, or the difference of two shares of the same samples, `drawn_B_N` says how often each draw contains each
    of its N samples, and `samples` how many are independent, if not all N. Else the interval is the bootstrap's alone.
    """
    value, (low, high) = float(value_B[0]), quantile_bounds(value_B[1:], level)
    if drawn_B_N is None or np.isnan(low):
        return Estimate(value, low, high)
    if high - low <= NO_WIDTH and (trials := independent(drawn_B_N)):
        # A difference is the share of the samples that only one of the two gets right; it may be up to that bound.
        middle = (low + high) / 2
        low, high = wilson_interval(min(abs(middle) if difference else max(middle, 0.0), 1.0) * trials, trials, level)
        if difference and abs(middle) <= NO_WIDTH:
            low = -high
        elif difference and middle < 0:
            low, high = -high, -low
    samples = drawn_B_N.shape[1] if samples is None else samples
    if samples and not difference and np.isfinite(value):
        least, most = wilson_interval(min(max(value, 0.0), 1.0) * samples, samples, level)
        low, high = min(low, least), max(high, most)
    return Estimate(value, low, high)


def corrected(
    value_M: np.ndarray,
    low_M: np.ndarray,
    high_M: np.ndarray,
    clusters_M: np.ndarray,
    picked: bool = True,
    reach: float = np.inf,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the bounds of M differences, widened for few clusters and for the best being picked from all of them.

    The distance of each bound grows from the normal quantile to Student's with a degree of freedom less than there are
    clusters, at levels by Holm (1979) if the differences are picked from: the largest relative to its width at
    1 - 0.05 / M, the next at 1 - 0.05 / (M - 1), and so on to the first that is not shown, whose level the others
    share. With fewer than `FEWEST_CLUSTERS`, all bounds reach 0. A difference without an interval keeps none. No bound
    is farther than `reach` from 0, the distance between the ends of what is compared.
    """
    from scipy.special import stdtrit

    low_M, high_M = np.array(low_M, float), np.array(high_M, float)
    usual = NormalDist().inv_cdf((1 + LEVEL) / 2)
    measured = np.flatnonzero(np.isfinite(high_M - low_M))
    with np.errstate(divide="ignore", invalid="ignore"):
        sizes = np.nan_to_num(np.abs(value_M[measured]) / (high_M - low_M)[measured], posinf=np.inf)
    left, shown = len(measured) if picked else 1, True
    for row in measured[np.argsort(-sizes, kind="stable")]:
        factor = stdtrit(max(clusters_M[row], FEWEST_CLUSTERS) - 1, 1 - (1 - LEVEL) / 2 / max(left, 1)) / usual
        low_M[row] = value_M[row] - factor * (value_M[row] - low_M[row])
        high_M[row] = value_M[row] + factor * (high_M[row] - value_M[row])
        shown = shown and not low_M[row] <= 0 <= high_M[row]
        left -= shown and picked
        if clusters_M[row] < FEWEST_CLUSTERS:
            low_M[row], high_M[row] = min(low_M[row], 0.0), max(high_M[row], 0.0)
    return np.maximum(low_M, -reach), np.minimum(high_M, reach)


def quantile_bounds(values_B: np.ndarray, level: float = LEVEL) -> tuple[float, float]:
    """Quantiles that enclose the middle `level` of the finite draws; NaN where there is none."""
    finite_B = values_B[np.isfinite(values_B)]
    if not len(finite_B):
        return np.nan, np.nan
    low, high = np.quantile(finite_B, [(1 - level) / 2, (1 + level) / 2])
    return float(low), float(high)


def independent(drawn_B_N: np.ndarray) -> int:
    """Number of combinations of a seed and a cluster among N samples: those of one are drawn equally often."""
    return len({column.tobytes() for column in np.ascontiguousarray(drawn_B_N.T)})


def wilson_interval(successes: float, trials: int, level: float = LEVEL) -> tuple[float, float]:
    """Score interval of a share (Wilson 1927), in [0, 1]; successes may be fractional, unlike SciPy's."""
    z = NormalDist().inv_cdf((1 + level) / 2)
    share = successes / trials
    center = share + z**2 / (2 * trials)
    half_width = z * sqrt(share * (1 - share) / trials + z**2 / (4 * trials**2))
    low, high = ((center + sign * half_width) / (1 + z**2 / trials) for sign in (-1, 1))
    return max(0.0, low), min(1.0, high)


@cache
def student_factor(repeats: int, level: float = LEVEL) -> float:
    """Half of Student's interval of a mean, in standard errors; NaN for one repeat."""
    from scipy.special import stdtrit

    return float(stdtrit(repeats - 1, (1 + level) / 2))


def mean_interval(values_R: Iterable[float], level: float = LEVEL) -> Estimate:
    """Mean of R repeats and its Student t-interval, mean ± t_{R-1} s / √R, not clipped; one repeat has NaN bounds."""
    values_R = np.asarray(list(values_R), dtype=float)
    if values_R.size == 0:
        raise ValueError("interval of no repeats")
    mean = float(values_R.mean())
    if values_R.size == 1:
        return Estimate(mean, np.nan, np.nan)
    half_width = float(student_factor(values_R.size, level) * (values_R.std(ddof=1) / np.sqrt(values_R.size)))
    return Estimate(mean, mean - half_width, mean + half_width)


def centered(value_B: np.ndarray) -> np.ndarray:
    """Values (1 + B,) whose draws are shifted until their mean is the value.

    Repeated samples inflate what is no mean over samples, for example a calibration error.
    """
    drawn_B, finite_B = value_B[1:], np.isfinite(value_B[1:])
    return np.append(value_B[:1], drawn_B - drawn_B[finite_B].mean() + value_B[0]) if finite_B.any() else value_B


def weighted_mean(value_N: np.ndarray, weights_B_N: np.ndarray) -> np.ndarray:
    """Mean of a value by weights of its samples (B,); NaN where no sample has weight."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return (weights_B_N * np.asarray(value_N, float)).sum(axis=1) / weights_B_N.sum(axis=1)


@dataclass(frozen=True)
class Clustered:
    """N test samples of several seeds, and how often each draw of a bootstrap over clusters and seeds contains them."""

    seed: np.ndarray
    cluster: np.ndarray
    weights: np.ndarray  # (1 + B, N): ones for the samples themselves, then the counts of each draw
    instance: np.ndarray | None = None  # (N,) that counts once, whatever its number of samples; None: each sample does

    @classmethod
    def drawn(cls, seed_N: Iterable, cluster_N: Iterable, *axes: object) -> Clustered:
        """Draw clusters and seeds; the axes name the random numbers, so the same axes and samples repeat the draws."""
        seed_N, cluster_N = np.asarray(seed_N), np.asarray(cluster_N, str)
        drawn_B_N = pigeonhole_weights(generator(*axes), seed_N, cluster_N)
        return cls(seed_N, cluster_N, np.vstack([np.ones(len(seed_N)), drawn_B_N]))

    def __len__(self) -> int:
        return len(self.seed)

    def subset(self, rows: np.ndarray) -> Clustered:
        """The given rows, or those of a mask, with their draws."""
        instance_n = None if self.instance is None else self.instance[rows]
        return Clustered(self.seed[rows], self.cluster[rows], self.weights[:, rows], instance_n)

    @property
    def counts(self) -> tuple[int, int, int]:
        """Numbers of seeds, clusters and samples."""
        return len(np.unique(self.seed)), len(np.unique(self.cluster)), len(self)

    @property
    def independent(self) -> int:
        """Number of instances, or of samples where each counts."""
        return len(self) if self.instance is None else len(np.unique(self.instance))

    @property
    def once(self) -> np.ndarray:
        """Weights (N,) by which an instance counts once."""
        if self.instance is None:
            return np.ones(len(self))
        _, instance_N, count = np.unique(self.instance, return_inverse=True, return_counts=True)
        return 1 / count[instance_N]

    def share(self, right_N: np.ndarray) -> Estimate:
        """Share of the samples that are right."""
        return interval(weighted_mean(right_N, self.weights * self.once), self.weights[1:], samples=self.independent)

    def difference(self, right_N: np.ndarray, other_N: np.ndarray) -> Estimate:
        """Share that is right minus another share of the same samples, paired by draw."""
        value_B = weighted_mean(right_N, self.weights) - weighted_mean(other_N, self.weights)
        return interval(value_B, self.weights[1:], difference=True)

    def mean(self, value_N: np.ndarray, limits: tuple[float, float] = ANYTHING) -> Estimate:
        """Mean of a value that is no share, with bounds within its limits."""
        return self.estimate(weighted_mean(value_N, self.weights), limits)

    def over_seeds(
        self, measure: Callable[[np.ndarray, np.ndarray], np.ndarray], limits: tuple[float, float] = ANYTHING
    ) -> Estimate:
        """Mean over the seeds, weighted by their samples, of a measure that is no mean over samples.

        It has values (1 + B,) of the samples in given rows (n,) with weights (1 + B, n). Its draws are
        :func:`centered`.
        """
        total_B, drawn_B = np.zeros(len(self.weights)), np.zeros(len(self.weights))
        for seed in np.unique(self.seed):
            rows = np.flatnonzero(self.seed == seed)
            weights_B_n = self.weights[:, rows]
            count_B = weights_B_n.sum(axis=1)
            total_B += np.where(count_B > 0, count_B * measure(rows, weights_B_n), 0.0)
            drawn_B += count_B
        with np.errstate(divide="ignore", invalid="ignore"):  # a draw without samples has no value
            value_B = total_B / drawn_B
        return self.estimate(centered(value_B), limits)

    def record(self, keys: tuple, estimate: Estimate) -> tuple:
        """Row of keys, numbers of seeds, clusters and samples, value and bounds."""
        return (*keys, *self.counts, *estimate)

    def estimate(self, value_B: np.ndarray, limits: tuple[float, float]) -> Estimate:
        """Interval of a statistic that is no share; one cluster in one seed gives none."""
        if independent(self.weights[1:]) < 2:
            return Estimate(float(value_B[0]), np.nan, np.nan)
        value, *bounds = interval(value_B)
        low, high = np.clip(bounds, *limits)
        return Estimate(value, float(low), float(high))


def best_of(values: Mapping[str, np.ndarray], names: Collection[str], least_is_best: bool = False) -> str:
    """Name with the best value on the samples themselves; empty where none has a value."""
    finite = [name for name in names if name in values and np.isfinite(values[name][0])]
    sign = -1 if least_is_best else 1
    return max(finite, key=lambda name: sign * values[name][0], default="")
