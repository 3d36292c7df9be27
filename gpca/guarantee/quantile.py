"""Bounds that a further sample exceeds with at most a given probability, from samples that it is exchangeable with.

Nothing is assumed of their distribution. What has to hold is that the further sample could as well have been any of
them: either sample by sample, or family by family, where samples of one family of shapes are alike and the further
sample is of a family that is not among them.
"""

from __future__ import annotations

from math import ceil, inf

import numpy as np

from gpca.errors import InputError

ROUNDING = 1e-9  # of a sum of weights


def upper_bound(value_N: np.ndarray, level: float, family_N: np.ndarray | None = None) -> float:
    """Return the value that a further sample does not exceed with a probability of at least `level`.

    Sample by sample it is the value of rank ⌈(N + 1) level⌉ (Vovk et al. 2005). Family by family each of K families
    weighs 1 / (K + 1), in equal parts over its samples, and the further sample's family, whose values could be any, as
    much (hierarchical conformal prediction, Lee, Barber and Willett 2023).

    Args:
        value_N: of samples that do not include the further one.
        level: in (0, 1).
        family_N: of every sample; None where samples are exchangeable one by one.

    Returns:
        the bound, infinite where there are too few samples, or families, for one.
    """
    if family_N is None:
        rank = ceil((len(value_N) + 1) * level - ROUNDING)
        return float(np.sort(value_N)[rank - 1]) if rank <= len(value_N) else inf
    _, number_N, size_K = np.unique(family_N, return_inverse=True, return_counts=True)
    weight_N = 1 / (size_K[number_N] * (len(size_K) + 1))
    order = np.argsort(value_N, kind="stable")
    enough_N = np.cumsum(weight_N[order]) >= level - ROUNDING
    return float(value_N[order][enough_N.argmax()]) if enough_N.any() else inf


def confident_upper_bound(value_N: np.ndarray, level: float, confidence: float) -> float:
    """Return the value that a share of at least `level` of all further samples do not exceed, with this confidence.

    :func:`upper_bound` holds on average over draws of the N samples; this one holds for the samples at hand, but for a
    share 1 - `confidence` of such draws. It is the smallest of the ordered values above which the upper
    Clopper-Pearson bound of the share is at most 1 - `level`; the samples have to be independent.

    Returns:
        the bound, infinite where there are too few samples for one.
    """
    from scipy.stats import binom

    above_N = np.arange(len(value_N))  # how many values are larger than the largest, the next one, …
    sure = int((binom.cdf(above_N, len(value_N), 1 - level) <= 1 - confidence + ROUNDING).sum())
    return float(np.sort(value_N)[-sure]) if sure else inf


def highest_level(samples: int, family_N: np.ndarray | None = None) -> float:
    """Return the largest `level` for which :func:`upper_bound` is finite: N / (N + 1), or K / (K + 1) of families."""
    count = samples if family_N is None else len(np.unique(family_N))
    return count / (count + 1)


def require_share(name: str, share: float) -> None:
    """Raise an InputError unless the share is strictly between 0 and 1."""
    if not 0 < share < 1:
        raise InputError(name, f"{share} is not strictly between 0 and 1", "give a share such as 0.9 or 0.05")
