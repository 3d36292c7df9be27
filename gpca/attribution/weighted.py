"""The diagnostics of :mod:`gpca.attribution.diagnostics` for B draws, in which samples stand ``weights_B_S`` times."""

import numpy as np

from gpca.attribution.diagnostics import BINS

TINY = 1e-6  # sums of squares of ranks that are not all the same are larger than rounding by far


def calibration_error(p_S_C: np.ndarray, target_S: np.ndarray, weights_B_S: np.ndarray) -> np.ndarray:
    confidence_S, hit_S = p_S_C.max(axis=1), p_S_C.argmax(axis=1) == target_S
    bin_S = np.minimum((confidence_S * BINS).astype(int), BINS - 1)
    gaps_B = np.zeros(len(weights_B_S))
    for inside_S in (bin_S == number for number in np.unique(bin_S)):
        gaps_B += np.abs((weights_B_S[:, inside_S] * (confidence_S - hit_S)[inside_S]).sum(axis=1))
    return _ratio(gaps_B, weights_B_S.sum(axis=1))


def aurc(confidence_S: np.ndarray, wrong_S: np.ndarray, weights_B_S: np.ndarray) -> np.ndarray:
    """Return the area under the risk-coverage curve (B,).

    Of k samples in order of their confidence, E(k) are wrong. In a group of w equal confidences, e of them wrong, E(k)
    rises evenly from E₀ at k = n: E(k) / k adds up to e + (E₀ - n e / w) (H(n + w) - H(n)), with harmonic numbers H.
    """
    count_B_G, wrong_B_G = _groups(confidence_S, wrong_S, weights_B_S)
    ends_B_G, errors_B_G = np.cumsum(count_B_G, axis=1), np.cumsum(wrong_B_G, axis=1)
    starts_B_G = ends_B_G - count_B_G
    before_B_G = errors_B_G - wrong_B_G - starts_B_G * wrong_B_G / np.maximum(count_B_G, 1)
    most = int(weights_B_S.sum(axis=1).max())  # samples of a draw
    harmonic_K = np.append(0.0, np.cumsum(1 / np.arange(1, most + 1)))
    width_B_G = harmonic_K[ends_B_G.astype(int)] - harmonic_K[starts_B_G.astype(int)]
    return _ratio((wrong_B_G + before_B_G * width_B_G).sum(axis=1), weights_B_S.sum(axis=1))


def excess_aurc(confidence_S: np.ndarray, wrong_S: np.ndarray, weights_B_S: np.ndarray) -> np.ndarray:
    """Return the area minus the least that the errors of a draw allow (B,)."""
    return aurc(confidence_S, wrong_S, weights_B_S) - aurc(~wrong_S, wrong_S, weights_B_S)


def augrc(confidence_S: np.ndarray, wrong_S: np.ndarray, weights_B_S: np.ndarray) -> np.ndarray:
    """Return the area under the generalized risk (B,): the mean of E(k) over k, divided by the number of samples."""
    count_B_G, wrong_B_G = _groups(confidence_S, wrong_S, weights_B_S)
    before_B_G = np.cumsum(wrong_B_G, axis=1) - wrong_B_G
    errors_B = (before_B_G * count_B_G + wrong_B_G * (count_B_G + 1) / 2).sum(axis=1)
    return _ratio(errors_B, weights_B_S.sum(axis=1) ** 2)


def rank_correlation(one_S: np.ndarray, other_S: np.ndarray, weights_B_S: np.ndarray) -> np.ndarray:
    drawn_B_1 = np.maximum(weights_B_S.sum(axis=1), 1)[:, None]
    centered = []
    for values_S in (one_S, other_S):
        order, starts = _order(np.asarray(values_S, float))
        count_B_G = np.add.reduceat(weights_B_S[:, order], starts, axis=1)
        middle_B_G = np.cumsum(count_B_G, axis=1) - (count_B_G - 1) / 2
        group_S = np.empty(len(order), int)
        group_S[order] = np.repeat(np.arange(len(starts)), np.diff(np.append(starts, len(order))))
        rank_B_S = middle_B_G[:, group_S]
        centered.append(rank_B_S - (weights_B_S * rank_B_S).sum(axis=1, keepdims=True) / drawn_B_1)
    rank_B_S, other_B_S = centered
    products_B = (weights_B_S * rank_B_S * other_B_S).sum(axis=1)
    squares_B = (weights_B_S * rank_B_S**2).sum(axis=1) * (weights_B_S * other_B_S**2).sum(axis=1)
    varied_B = squares_B > TINY
    return np.where(varied_B, products_B / np.sqrt(np.where(varied_B, squares_B, 1.0)), 0.0)


def _groups(confidence_S: np.ndarray, wrong_S: np.ndarray, weights_B_S: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return how many samples of each confidence a draw has, and how many of them are wrong (B, G), surest first."""
    order, starts = _order(-np.asarray(confidence_S, float))
    ordered_B_S = weights_B_S[:, order]
    wrong_B_S = ordered_B_S * np.asarray(wrong_S, float)[order]
    return np.add.reduceat(ordered_B_S, starts, axis=1), np.add.reduceat(wrong_B_S, starts, axis=1)


def _order(values_S: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the order of rising values, and where in it each different value begins."""
    order = np.argsort(values_S, kind="stable")
    return order, np.flatnonzero(np.append(True, np.diff(values_S[order]) != 0))


def _ratio(one_B: np.ndarray, other_B: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore", invalid="ignore"):  # a draw without any sample has no value
        return one_B / other_B
