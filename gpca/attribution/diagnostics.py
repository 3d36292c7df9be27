"""The worth of an explainer's uncertainty: whether it separates right from wrong, and whether it is calibrated.

Of S samples: ``wrong_S`` whether each was named wrongly, ``confidence_S`` any score that is higher where the explainer
is surer, ``p_S_C`` class probabilities, ``target_S`` numbers of the true classes. In B draws, they stand
``weights_B_S`` times; without weights, each stands once.
"""

from collections.abc import Callable
from functools import wraps

import numpy as np

BINS = 15  # calibration errors are measured over so many (Guo et al. 2017)
LEAST_PROBABILITY = 1e-12  # that a true class counts with
TINY = 1e-6  # sums of squares of ranks that are not all the same are larger than rounding by far


def of_draws(measure: Callable[..., np.ndarray]) -> Callable:
    """Let a measure (B,) of weighted samples take no weights, too, and then return a number."""

    @wraps(measure)
    def measured(one_S: np.ndarray, other_S: np.ndarray, weights_B_S: np.ndarray | None = None) -> np.ndarray | float:
        one_S, other_S = np.asarray(one_S), np.asarray(other_S)
        if weights_B_S is None:
            return float(measure(one_S, other_S, np.ones((1, len(one_S))))[0])
        return measure(one_S, other_S, weights_B_S)

    return measured


@of_draws
def calibration_error(p_S_C: np.ndarray, target_S: np.ndarray, weights_B_S: np.ndarray) -> np.ndarray:
    """Return the mean over `BINS` equally wide bins of |mean confidence - accuracy| (ECE, (B,))."""
    confidence_S, hit_S = p_S_C.max(axis=1), p_S_C.argmax(axis=1) == target_S
    bin_S = np.minimum((confidence_S * BINS).astype(int), BINS - 1)
    gaps_B = np.zeros(len(weights_B_S))
    for inside_S in (bin_S == number for number in np.unique(bin_S)):
        gaps_B += np.abs((weights_B_S[:, inside_S] * (confidence_S - hit_S)[inside_S]).sum(axis=1))
    return _ratio(gaps_B, weights_B_S.sum(axis=1))


@of_draws
def aurc(confidence_S: np.ndarray, wrong_S: np.ndarray, weights_B_S: np.ndarray) -> np.ndarray:
    """Return the area under the risk-coverage curve (B,); least is best (Geifman et al. 2019).

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


@of_draws
def excess_aurc(confidence_S: np.ndarray, wrong_S: np.ndarray, weights_B_S: np.ndarray) -> np.ndarray:
    """Return the area minus the least that the errors of a draw allow (B,) (E-AURC)."""
    return aurc(confidence_S, wrong_S, weights_B_S) - aurc(~wrong_S, wrong_S, weights_B_S)


@of_draws
def augrc(confidence_S: np.ndarray, wrong_S: np.ndarray, weights_B_S: np.ndarray) -> np.ndarray:
    """Return the mean of E(k) over k, divided by the number of samples (B,) (Traub et al. 2024)."""
    count_B_G, wrong_B_G = _groups(confidence_S, wrong_S, weights_B_S)
    before_B_G = np.cumsum(wrong_B_G, axis=1) - wrong_B_G
    errors_B = (before_B_G * count_B_G + wrong_B_G * (count_B_G + 1) / 2).sum(axis=1)
    return _ratio(errors_B, weights_B_S.sum(axis=1) ** 2)


@of_draws
def rank_correlation(one_S: np.ndarray, other_S: np.ndarray, weights_B_S: np.ndarray) -> np.ndarray:
    """Return Spearman's ρ (B,); 0 where one of the two is constant."""
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


def negative_log_likelihood(p_S_C: np.ndarray, target_S: np.ndarray) -> float:
    return float(-np.log(np.maximum(p_S_C[np.arange(len(target_S)), target_S], LEAST_PROBABILITY)).mean())


def brier_score(p_S_C: np.ndarray, target_S: np.ndarray) -> float:
    """Return the mean over samples of Σ_c (p_c - 1{y = c})², between 0 and 2 (Brier 1950)."""
    return float(np.square(p_S_C - np.eye(p_S_C.shape[1])[target_S]).sum(axis=1).mean())


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
