"""Trimmed ICP (Chetverikov et al. 2002): least squares over the share of points that overlap, which it finds itself."""

from __future__ import annotations

import numpy as np

from gpca.alignment.methods.interface import CORRESPONDENCE_DISTANCE, MAX_ITERATIONS, MethodEntry, Outcome, Pair
from gpca.alignment.methods.stages import Stages, run_stages
from gpca.alignment.methods.variants import nearest
from gpca.settings import Share

LEAST_OVERLAP = 0.4  # the paper's; so far down the overlap is searched
EXPONENT = 2.0  # the paper's λ: how much a larger overlap is worth


def align(
    pair: Pair,
    overlap: Share = 0.0,
    correspondence_distance: float = CORRESPONDENCE_DISTANCE,
    max_iterations: int = MAX_ITERATIONS,
) -> Outcome:
    """Align the share `overlap` of the source that fits best; with 0, the share that fits best is searched too.

    The search minimizes ψ(ξ) = e / ξ^(1+λ), e the mean square of the trimmed distances. No distance is too large for a
    correspondence; `correspondence_distance` only measures the outcome.
    """
    if not overlap:
        from scipy.optimize import minimize_scalar

        optimum = minimize_scalar(
            lambda share: _objective(pair, share, max_iterations),
            bounds=(LEAST_OVERLAP, 1.0),
            method="bounded",
            options={"xatol": 0.02, "maxiter": 12},
        )
        overlap = float(optimum.x)
    T, _, failure = _run(pair, overlap, max_iterations)
    return Outcome.at(pair, T, correspondence_distance, failure)


def _run(pair: Pair, share: float, max_iterations: int):
    return run_stages(
        pair, Stages(reject=lambda matches: matches.kept(nearest(matches.distance, share))), max_iterations
    )


def _objective(pair: Pair, share: float, max_iterations: int) -> float:
    _, matches, _ = _run(pair, share, max_iterations)
    return float(np.square(matches.distance).mean()) / share ** (1 + EXPONENT)


METHODS = {"trimmed": MethodEntry("Trimmed ICP", align)}
