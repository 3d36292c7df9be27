"""Hypotheses of the true pose in a depth frame, with the probability of each.

As for whole objects (:mod:`gpca.reenactment.hypotheses`), but a camera sees one side of an object: the mixture is
around the points that would be seen at a pose, and what hides the others is not a half-space but whatever stands in
front. At a wrong pose another side would be seen, or much of it where nothing was measured.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from gpca.causes.settings import FEWEST_POINTS
from gpca.reenactment.frame_view import FrameView
from gpca.reenactment.hypotheses import (
    FITTED,
    INDEPENDENT,
    LEAST_COVERED,
    SAME,
    Hypothesis,
    anchor_of,
    log_prior,
    most_probable,
    not_negligible,
    search_ends,
)
from gpca.reenactment.mixture import Anchor, Mixture
from gpca.reenactment.mixture_kernels import LARGEST_WIDTH
from gpca.reenactment.settings import ReenactmentSettings

COARSE, FINE = 1200, 3000  # pixels at which a side is looked at, about
ITERATIONS, ROUNDS = 12, 2  # of the mixture; of all points, in rounds with the side of the pose that the last one found
OUT_OF_REACH = 12.0  # nats below the best that are not made up for by more points
MISSING = 4.0  # nats that a hypothesis loses whose side was not measured at all
IMPOSSIBLE = -1e6  # nats, of a pose at which nothing would be seen


def find_frame_hypotheses(
    view: FrameView, settings: ReenactmentSettings, random: np.random.Generator
) -> list[Hypothesis]:
    """Return the probable hypotheses, the best first."""
    before, surface = view.before, view.known.surface
    few = before[np.sort(random.permutation(len(before))[:FITTED])]
    ends_n = search_ends(before, surface, view.T_found_n, random)

    def fits(T_n: np.ndarray, observed: np.ndarray, pixels: int, rounds: int) -> list[Hypothesis]:
        anchor = anchor_of(len(observed), settings)
        free = [_fit(view, T, observed, pixels, rounds, settings) for T in T_n]
        return [*free, _fit(view, np.eye(4), observed, pixels, rounds, settings, anchor)]

    first = most_probable(fits(ends_n, few, COARSE, 1), surface, settings.hypotheses, SAME)
    first = not_negligible(first, OUT_OF_REACH)
    T_n = np.stack([hypothesis.T for hypothesis in first])
    found = fits(T_n, before, FINE, ROUNDS)
    return not_negligible(most_probable(found, surface, settings.hypotheses, SAME / 2))


def _fit(
    view: FrameView,
    T: np.ndarray,
    observed: np.ndarray,
    pixels: int,
    rounds: int,
    settings: ReenactmentSettings,
    anchor: Anchor | None = None,
) -> Hypothesis:
    """Return the pose that explains the observed points best, near another; each round looks at the side anew."""
    for _ in range(rounds):
        side, share = view.side(T, pixels)
        if len(side) < FEWEST_POINTS:
            return Hypothesis(T, np.zeros(len(observed)), 0.0, LARGEST_WIDTH, 0.0, IMPOSSIBLE)
        fits = Mixture(side, _spacing(side) / 2).fit(observed, T[None], ITERATIONS, anchor=anchor)
        T = fits.T_n[0]
    likelihood, outliers = float(fits.log_likelihood_n[0]), float(fits.outliers_n[0])
    # What was measured of the side is the denser, the less of it was.
    density = (1 - outliers) * np.log(max(share, LEAST_COVERED))
    log_posterior = min(len(observed), INDEPENDENT) * (likelihood - density) + log_prior(T, settings)
    log_posterior -= MISSING * (1 - share)
    return Hypothesis(T, fits.inlier_n_N[0], likelihood, float(fits.width_n[0]), share, float(log_posterior))


def _spacing(points: np.ndarray) -> float:
    """Return the median distance of points (V, 3) from the nearest other."""
    return float(np.median(cKDTree(points).query(points, 2)[0][:, 1]))
