"""The interval of a share of counted samples that stays within 0 and 1."""

from __future__ import annotations

from math import sqrt
from statistics import NormalDist


def wilson_interval(successes: float, trials: int, level: float = 0.95) -> tuple[float, float]:
    """Return the bounds in [0, 1] of a share's score interval (Wilson 1927).

    Raises:
        ValueError: no trials.
    """
    if trials < 1:
        raise ValueError("interval of no trials")
    z = NormalDist().inv_cdf((1 + level) / 2)
    share = successes / trials
    centre = share + z**2 / (2 * trials)
    half_width = z * sqrt(share * (1 - share) / trials + z**2 / (4 * trials**2))
    low, high = ((centre + sign * half_width) / (1 + z**2 / trials) for sign in (-1, 1))
    return max(0.0, low), min(1.0, high)
