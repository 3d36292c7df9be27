"""Confidence intervals: by the bootstrap on samples of objects in seeds, and of a share of counted samples.

Objects and seeds are crossed: an object is tested in several seeds, a seed tests several objects. The pigeonhole
bootstrap (Owen 2007) draws both with replacement and weighs a sample by the product of how often its own were drawn.

Where all draws have the same value, as of a share of 100 %, the bootstrap says nothing about how wide the interval is.
Then the share has Wilson's interval, in which a cluster counts once in each seed, whatever its number of samples: that
all of them agree leaves open how alike they are, and this is the most cautious answer.
"""

from __future__ import annotations

from math import sqrt
from statistics import NormalDist

import numpy as np

REPEATS = 500
LEVEL = 0.95
NO_WIDTH = 1e-9  # of an interval: the draws differ by rounding alone


def pigeonhole_weights(random: np.random.Generator, *factors: np.ndarray) -> np.ndarray:
    """Return how often each of N samples is drawn, (`REPEATS`, N).

    Args:
        random: draws the levels of the factors, one factor after the other.
        factors: of every sample its level of one factor, (N,) each, e.g. its seed and its object.
    """
    weights_B_N = np.ones((REPEATS, len(factors[0])))
    for factor_N in factors:
        names, number_N = np.unique(factor_N, return_inverse=True)
        drawn_B_K = random.multinomial(len(names), np.full(len(names), 1 / len(names)), size=REPEATS)
        weights_B_N *= drawn_B_K[:, number_N]
    return weights_B_N


def bounds(
    values_B: np.ndarray, drawn_B_N: np.ndarray | None = None, difference: bool = False, level: float = LEVEL
) -> tuple[float, float]:
    """Return the bounds of the draws' middle `level`; those without a value are left out, and NaN is returned for none.

    Args:
        values_B: of every draw.
        drawn_B_N: for a share of samples, in [0, 1], how often each draw has each of the N that it is a share of. An
            interval of no width is then replaced by Wilson's.
        difference: whether the values are differences of two shares of the same samples.
    """
    known = values_B[np.isfinite(values_B)]
    if not len(known):
        return np.nan, np.nan
    low, high = (float(bound) for bound in np.quantile(known, [(1 - level) / 2, (1 + level) / 2]))
    if drawn_B_N is None or high - low > NO_WIDTH or not (trials := independent(drawn_B_N)):
        return low, high
    value = (low + high) / 2
    if not difference:
        return wilson_interval(min(max(value, 0.0), 1.0) * trials, trials, level)
    # As many samples are right by one only as the difference says, and up to the upper bound of that share may be.
    least, most = wilson_interval(min(abs(value), 1.0) * trials, trials, level)
    return (-most, most) if abs(value) <= NO_WIDTH else (least, most) if value > 0 else (-most, -least)


def independent(drawn_B_N: np.ndarray) -> int:
    """Return how many combinations of levels, as of a seed and a cluster, the N samples are of.

    Samples of one combination are in every draw equally often.
    """
    return len({column.tobytes() for column in np.ascontiguousarray(drawn_B_N.T)})


def wilson_interval(successes: float, trials: int, level: float = 0.95) -> tuple[float, float]:
    """Return the bounds in [0, 1] of a share's score interval (Wilson 1927).

    Raises:
        ValueError: no trials.
    """
    if trials < 1:
        raise ValueError("interval of no trials")
    z = NormalDist().inv_cdf((1 + level) / 2)
    share = successes / trials
    center = share + z**2 / (2 * trials)
    half_width = z * sqrt(share * (1 - share) / trials + z**2 / (4 * trials**2))
    low, high = ((center + sign * half_width) / (1 + z**2 / trials) for sign in (-1, 1))
    return max(0.0, low), min(1.0, high)
