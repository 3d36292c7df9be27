"""Trimmed ICP (Chetverikov et al. 2002): least squares over the overlapping share of points, which it estimates."""

from __future__ import annotations

from functools import cache

import numpy as np

from gpca.alignment.methods.interface import CORRESPONDENCE_DISTANCE, MAX_ITERATIONS, MethodEntry, Outcome, Pair
from gpca.alignment.methods.stages import Matches, Stages, run_stages
from gpca.settings import Share

LEAST_OVERLAP = 0.4  # lower end of the search, as in the paper
EXPONENT = 2.0  # λ of the paper, the preference for a larger overlap


def align(
    pair: Pair,
    overlap: Share = 0.0,
    correspondence_distance: float = CORRESPONDENCE_DISTANCE,
    max_iterations: int = MAX_ITERATIONS,
) -> Outcome:
    """Align the share `overlap` of the source that fits best; with 0, minimize over the share ξ too.

    The minimized objective is ψ(ξ) = e / ξ^(1+λ), e the mean square of the trimmed distances. `correspondence_distance`
    does not limit correspondences; it only measures the outcome.
    """

    @cache
    def run(share: float) -> tuple[np.ndarray, Matches, str]:
        return run_stages(pair, Stages(share=share), max_iterations)

    def objective(share: float) -> float:
        _, matches, _ = run(share)
        return float(np.square(matches.distance).mean()) / share ** (1 + EXPONENT)

    if not overlap:
        from scipy.optimize import minimize_scalar

        bounds, options = (LEAST_OVERLAP, 1.0), {"xatol": 0.02, "maxiter": 12}
        overlap = minimize_scalar(objective, bounds=bounds, method="bounded", options=options).x
    T, _, failure = run(overlap)
    return Outcome.at(pair, T, correspondence_distance, failure)


METHODS = {"trimmed": MethodEntry("Trimmed ICP", align)}
