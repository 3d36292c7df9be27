"""Which poses are accepted: those below a limit of a score, so that few of the accepted ones are wrong."""

from __future__ import annotations

from statistics import NormalDist

import numpy as np

WRONG = 0.05  # largest share of wrong poses among those that are accepted
CONFIDENCE = 0.8


def accepted_below(score_N: np.ndarray, wrong_N: np.ndarray, family_N: np.ndarray) -> float | None:
    """Return the largest score below which at most the share `WRONG` of the poses is wrong; None if there is none.

    The upper bound of their share, one-sided at `CONFIDENCE`, stays below it: families are drawn as wholes
    (linearized ratio of sums), and one more accepted and wrong pose is counted.
    """
    score_N, wrong_N = np.asarray(score_N, float), np.asarray(wrong_N, bool)
    rows = np.flatnonzero(np.isfinite(score_N))
    rows = rows[np.argsort(score_N[rows], kind="stable")]
    score_n, wrong_n = score_N[rows], wrong_N[rows]
    families, number_n = np.unique(np.asarray(family_N)[rows], return_inverse=True)
    own_n_F = number_n[:, None] == np.arange(len(families))
    accepted_n_F, off_n_F = np.cumsum(own_n_F, axis=0), np.cumsum(own_n_F & wrong_n[:, None], axis=0)
    total_n, off_n, reached_n = accepted_n_F.sum(axis=1), off_n_F.sum(axis=1), (accepted_n_F > 0).sum(axis=1)
    squares_n = np.square(off_n_F - (off_n / total_n)[:, None] * accepted_n_F).sum(axis=1)
    spread_n = np.sqrt(np.maximum(reached_n, 2) / np.maximum(reached_n - 1, 1) * squares_n) / total_n
    bound_n = (off_n + 1) / (total_n + 1) + NormalDist().inv_cdf(CONFIDENCE) * spread_n
    last_n = np.append(np.diff(score_n) > 0, np.ones(len(score_n[:1]), bool))  # equal scores are accepted together
    kept = np.flatnonzero((bound_n <= WRONG) & last_n)
    return float(np.nextafter(score_n[kept[-1]], np.inf)) if len(kept) else None


def accepted_in_hindsight(score_N: np.ndarray, wrong_N: np.ndarray, weights_B_N: np.ndarray) -> np.ndarray:
    """Return which poses (B, N) are accepted by the largest limit that these very poses allow; it promises nothing."""
    order = np.argsort(score_N, kind="stable")
    weights_B_n, score_n = weights_B_N[:, order] * np.isfinite(score_N[order]), score_N[order]
    total_B_n, off_B_n = np.cumsum(weights_B_n, axis=1), np.cumsum(weights_B_n * wrong_N[order], axis=1)
    last_n = np.append(score_n[1:] > score_n[:-1], np.ones(len(score_n[:1]), bool))
    allowed_B_n = (off_B_n <= WRONG * total_B_n) & (total_B_n > 0) & last_n & np.isfinite(score_n)
    count_B = (allowed_B_n * np.arange(1, len(order) + 1)).max(axis=1, initial=0)
    accepted_B_N = np.zeros(weights_B_N.shape, bool)
    accepted_B_N[:, order] = np.arange(len(order)) < count_B[:, None]
    return accepted_B_N
