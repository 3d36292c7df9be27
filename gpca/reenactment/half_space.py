"""The surface that an observation misses: the half-space that takes most of the model and next to nothing observed."""

from __future__ import annotations

from functools import cache

import numpy as np

from gpca.process.compilation import njit

DIRECTIONS = 150
BEYOND = 2.5  # observed points that may lie beyond the plane,
BEYOND_SHARE = 0.01  # or this share of them
LEAST_SHARE = 0.07  # of the model, that counts as missing: as much may lie beyond the plane by chance
LEAST_KEPT = 0.125  # of the model


def share_within(model: np.ndarray, observed: np.ndarray, noise: float, random: np.random.Generator) -> float:
    """Return the least share of a model (M, 3) before any plane that what was observed (N, 3) does not pass.

    Noise carries observed points beyond the true edge, so this is an upper bound of what is covered.
    """
    return _cut(model, observed, noise * random.normal(size=len(model)))[1]


def covered_points(model: np.ndarray, observed: np.ndarray, noise: float, random: np.random.Generator) -> np.ndarray:
    """Return which points of a model (M, 3) lie on the side of the plane that was observed, (M,) bool.

    The model is blurred as much as what was observed; what of it reaches as far is covered.

    Args:
        observed: (N, 3) in the model's frame, without outliers.
        noise: standard deviation per axis.
    """
    blur_M = noise * random.normal(size=len(model))
    direction, share, limit = _cut(model, observed, blur_M)
    if share > 1 - LEAST_SHARE:
        return np.ones(len(model), bool)
    along_M = (model * direction).sum(axis=1)
    order_M = np.argsort(along_M, kind="stable")
    kept = _reaching((along_M + blur_M)[order_M], limit, _beyond(len(observed)) / len(observed))
    covered_M = np.zeros(len(model), bool)
    covered_M[order_M[:kept]] = True
    return covered_M


def _cut(model: np.ndarray, observed: np.ndarray, blur_M: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Return the direction (3,) in which the least of the model lies before the limit of what was observed."""
    share_K, limit_K = np.empty(DIRECTIONS), np.empty(DIRECTIONS)
    observed = np.ascontiguousarray(observed)
    _shares_within(directions(), observed, model, blur_M, _beyond(len(observed)), limit_K, share_K)
    best = int(share_K.argmin())
    return directions()[best], float(share_K[best]), float(limit_K[best])


def _beyond(count: int) -> int:
    """Return how many of the observed points may lie beyond the plane."""
    return max(0, count - 1 - int(np.ceil((1 - max(BEYOND_SHARE, BEYOND / count)) * (count - 1))))


@cache
def directions() -> np.ndarray:
    """Return unit vectors (K, 3) spread evenly over the sphere (a spiral of Fibonacci)."""
    i = np.arange(DIRECTIONS) + 0.5
    z, turn = 1 - 2 * i / DIRECTIONS, np.pi * (1 + 5**0.5) * i
    across = np.sqrt(1 - z * z)
    return np.column_stack([np.cos(turn) * across, np.sin(turn) * across, z])


def _reaching(blurred_M: np.ndarray, limit: float, beyond: float) -> int:
    """Return how many points, in their order, reach so far that this share of them lies beyond the limit."""
    over_M = np.cumsum(blurred_M > limit) / np.arange(1, len(blurred_M) + 1)
    reaching = np.flatnonzero(over_M > beyond)
    return max(int(LEAST_KEPT * len(blurred_M)), int(reaching[0]) if len(reaching) else len(blurred_M))


@njit(cache=True, error_model="numpy")
def _shares_within(directions, observed, model, blur, beyond, limits, shares):
    """For each direction (K, 3) fill the limit with so many observed points beyond, and the model's share within."""
    largest = np.empty(beyond + 1)
    for k in range(len(directions)):
        x, y, z = directions[k, 0], directions[k, 1], directions[k, 2]
        largest[:] = -np.inf
        for i in range(len(observed)):
            along = observed[i, 0] * x + observed[i, 1] * y + observed[i, 2] * z
            if along > largest[beyond]:
                slot = beyond
                while slot > 0 and largest[slot - 1] < along:
                    largest[slot] = largest[slot - 1]
                    slot -= 1
                largest[slot] = along
        limits[k] = largest[beyond]
        within = 0
        for m in range(len(model)):
            within += model[m, 0] * x + model[m, 1] * y + model[m, 2] * z + blur[m] <= limits[k]
        shares[k] = within / len(model)
