"""Differences between explainers on the same samples, with intervals by the same draws of a bootstrap.

A claim that one is better is its difference from the best of those that need no training, and from its best rival.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from gpca.attribution.confidence import bounds

UNTRAINED = ("chance", "most_frequent", "rule")  # explainers of baselines/untrained.py, of concepts and of causes


@dataclass(frozen=True)
class Difference:
    """The value of a measure minus that of another explainer.

    Attributes:
        other: its name; empty where there is none, and then the numbers are NaN.
        value, low, high: on the samples as they are, and the bounds of the interval.
    """

    other: str = ""
    value: float = np.nan
    low: float = np.nan
    high: float = np.nan

    @property
    def cells(self) -> tuple[str, float, float, float]:
        """The four as a row of a file has them."""
        return self.other, self.value, self.low, self.high


def shares(right: Mapping[str, np.ndarray], weights_B_N: np.ndarray) -> dict[str, np.ndarray]:
    """Return the share of the samples that is right (B,), by explainer.

    Args:
        right: explainer -> how right it is on each of the same N samples, from 0 to 1.
        weights_B_N: of the samples as they are, ones, and then how often each draw has them.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        return {name: (weights_B_N * right_N).sum(axis=1) / weights_B_N.sum(axis=1) for name, right_N in right.items()}


def best_of(values: Mapping[str, np.ndarray], names: Collection[str], smaller_is_better: bool = False) -> str:
    """Return that of the names with the best value on the samples as they are; empty where none has a value."""
    known = [name for name in names if name in values and np.isfinite(values[name][0])]
    sign = -1 if smaller_is_better else 1
    return max(known, key=lambda name: sign * values[name][0], default="")


def difference(
    values: Mapping[str, np.ndarray], name: str, other: str, drawn_B_N: np.ndarray | None = None
) -> Difference:
    """Return how far an explainer lies above another.

    Args:
        values: explainer -> its measure (B,), first on the samples as they are, and then on every draw.
        name, other: the two; no other has no difference.
        drawn_B_N: how often each draw has each sample, where the measure is a share of them, see
            :func:`gpca.attribution.confidence.bounds`.
    """
    if not other:
        return Difference()
    apart_B = values[name] - values[other]
    return Difference(other, float(apart_B[0]), *bounds(apart_B[1:], drawn_B_N, difference=True))


def from_untrained(
    values: Mapping[str, np.ndarray],
    name: str,
    smaller_is_better: bool = False,
    drawn_B_N: np.ndarray | None = None,
) -> Difference:
    """Return how far an explainer lies above the best untrained one, other than itself."""
    return from_rival(values, name, UNTRAINED, smaller_is_better, drawn_B_N)


def from_rival(
    values: Mapping[str, np.ndarray],
    name: str,
    rivals: Collection[str],
    smaller_is_better: bool = False,
    drawn_B_N: np.ndarray | None = None,
) -> Difference:
    """Return how far an explainer lies above the best of its other rivals; of equals, the first by name."""
    others = sorted(other for other in rivals if other != name)
    return difference(values, name, best_of(values, others, smaller_is_better), drawn_B_N)
