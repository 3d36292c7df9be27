"""Measures of test samples with intervals over clusters and seeds, made in one way for all tables.

A cluster is what looks alike: a family of objects, a scene, a rendered table. Intervals are those of the pigeonhole
bootstrap over clusters and seeds; a share on which all draws agree has Wilson's (:mod:`gpca.attribution.confidence`).
Few clusters may be alike by chance, so the interval of a share is at least that of as many independent samples.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gpca.attribution.confidence import bounds, independent, pigeonhole_weights, wilson_interval
from gpca.attribution.paired import shares
from gpca.errors import InputError
from gpca.io.csv_file import read_numbers
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

KEYS = ("table", "source", "method", "metric", "concept")
COLUMNS = (*KEYS, "seeds", "clusters", "samples", "value", "low", "high")
ANYTHING = (-np.inf, np.inf)  # limits of a value that has none


class Estimate(NamedTuple):
    """A value, and the bounds of its 95 % interval, NaN where there is none."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Clustered:
    """N test samples of several seeds, and how often a bootstrap over clusters and seeds draws each.

    Attributes:
        seed: (N,) the repeat. cluster: (N,) what each sample is alike with.
        weights: (1 + B, N) of the samples as they are, ones, and then how often each draw has them.
    """

    seed: np.ndarray
    cluster: np.ndarray
    weights: np.ndarray

    @classmethod
    def drawn(cls, seed_N: Iterable, cluster_N: Iterable, *axes: object) -> Clustered:
        """Draw clusters and seeds.

        Args:
            seed_N, cluster_N: of each sample.
            axes: name the random numbers; with the same ones, the same seeds and clusters have the same draws.
        """
        seed_N, cluster_N = np.asarray(seed_N), np.asarray(cluster_N, str)
        drawn_B_N = pigeonhole_weights(generator(*axes), seed_N, cluster_N)
        return cls(seed_N, cluster_N, np.vstack([np.ones(len(seed_N)), drawn_B_N]))

    def __len__(self) -> int:
        return len(self.seed)

    def subset(self, rows: np.ndarray) -> Clustered:
        """Return the given rows, which may be a mask, with the same draws."""
        return Clustered(self.seed[rows], self.cluster[rows], self.weights[:, rows])

    def share(self, right_N: np.ndarray) -> Estimate:
        """Return the share of the samples that are right.

        Its bounds are the farther ones of the bootstrap's and of Wilson's interval, as if all samples were independent.
        """
        value_B = _mean(right_N, self.weights)
        value, (low, high) = float(value_B[0]), bounds(value_B[1:], self.weights[1:])
        least, most = wilson_interval(value * len(self), len(self))
        return Estimate(value, min(low, least), max(high, most))

    def difference(self, right_N: np.ndarray, other_N: np.ndarray) -> Estimate:
        """Return the share that is right minus another share of the same samples, draw by draw."""
        value_B = _mean(right_N, self.weights) - _mean(other_N, self.weights)
        return Estimate(float(value_B[0]), *bounds(value_B[1:], self.weights[1:], difference=True))

    def mean(self, value_N: np.ndarray, limits: tuple[float, float] = ANYTHING) -> Estimate:
        """Return the mean of a value that is no share, with bounds within its limits."""
        return self._estimate(_mean(value_N, self.weights), limits)

    def over_seeds(
        self, measure: Callable[[np.ndarray, np.ndarray], np.ndarray], limits: tuple[float, float] = ANYTHING
    ) -> Estimate:
        """Return the mean over the seeds, by their samples, of a measure that is no mean over samples.

        Such a measure may be larger in samples that repeat some, as a calibration error is. So its draws are shifted
        until their mean is the value.

        Args:
            measure: returns the values (1 + B,) of some of the samples, given their rows (n,) and weights (1 + B, n).
            limits: of the measure, and so of the bounds.
        """
        total_B, drawn_B = (np.zeros(len(self.weights)) for _ in range(2))
        for seed in np.unique(self.seed):
            rows = np.flatnonzero(self.seed == seed)
            of_seed = self.weights[:, rows]
            count_B = of_seed.sum(axis=1)
            total_B += np.where(count_B > 0, count_B * measure(rows, of_seed), 0.0)
            drawn_B += count_B
        with np.errstate(divide="ignore", invalid="ignore"):  # a draw without any sample has no value
            value_B = total_B / drawn_B
        known_B = value_B[1:][np.isfinite(value_B[1:])]
        return self._estimate(np.append(value_B[:1], known_B - known_B.mean() + value_B[0]), limits)

    def record(self, keys: tuple[str, str, str, str, str], estimate: Estimate) -> tuple:
        """Return a row of `COLUMNS`, given the entries of `KEYS`."""
        return (*keys, len(np.unique(self.seed)), len(np.unique(self.cluster)), len(self), *estimate)

    def _estimate(self, value_B: np.ndarray, limits: tuple[float, float]) -> Estimate:
        if independent(self.weights[1:]) < 2:  # a single cluster in a single seed says nothing of others
            return Estimate(float(value_B[0]), np.nan, np.nan)
        low, high = np.clip(bounds(value_B[1:]), *limits)
        return Estimate(float(value_B[0]), float(low), float(high))


def intervals(records: list[tuple], name: str) -> pd.DataFrame:
    """Return the rows that :meth:`Clustered.record` made.

    Raises:
        InputError: there are none; `name` says of what.
    """
    import pandas as pd

    if not records:
        raise InputError(name, "no files were given", "run its step first")
    return pd.DataFrame(records, columns=list(COLUMNS))


def read_clustered(path: str | Path) -> pd.DataFrame:
    """Read a file of intervals (`COLUMNS`); a value without an interval has bounds that are NaN.

    Raises:
        InputError: missing, empty or unreadable file, missing column, a value that is no finite number.
    """
    return read_numbers(path, COLUMNS, COLUMNS[len(KEYS) :], optional=("low", "high"))


def _mean(value_N: np.ndarray, weights_B_N: np.ndarray) -> np.ndarray:
    return shares({"": np.asarray(value_N, float)}, weights_B_N)[""]
