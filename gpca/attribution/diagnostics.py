"""The worth of an explainer's uncertainty: whether it separates right from wrong, and whether it is calibrated.

Functions of S test samples: ``wrong_S`` whether each was named wrongly, ``confidence_S`` any score that is higher where
the explainer is surer, ``p_S_C`` class probabilities and ``target_S`` the numbers of the true classes. All are finite
for any input that they take; what they refuse raises ValueError.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

BINS = 15  # calibration errors are measured over so many (Guo et al. 2017)


def risk_coverage(confidence_S: np.ndarray, wrong_S: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return coverage k / S and risk, the share of errors among the k most confident samples, for k = 1 … S.

    Samples of equal confidence come in no order; the risk is its mean over all orders of them.
    """
    confidence_S, wrong_S = _samples(confidence_S, wrong_S)
    k_S = np.arange(1, len(wrong_S) + 1)
    return k_S / len(wrong_S), _cumulative_errors(confidence_S, wrong_S) / k_S


def aurc(confidence_S: np.ndarray, wrong_S: np.ndarray) -> float:
    """Return the area under the risk-coverage curve, the mean of its S risks (Geifman et al. 2019); least is best."""
    return float(risk_coverage(confidence_S, wrong_S)[1].mean())


def excess_aurc(confidence_S: np.ndarray, wrong_S: np.ndarray) -> float:
    """Return the area minus the least that these errors allow, with all of them last (E-AURC); 0 is best."""
    _, wrong_S = _samples(confidence_S, wrong_S)
    return aurc(confidence_S, wrong_S) - aurc(~wrong_S, wrong_S)


def augrc(confidence_S: np.ndarray, wrong_S: np.ndarray) -> float:
    """Return the area under the generalized risk, errors among the k most confident over S (Traub et al. 2024).

    The share of undetected failures. At error rate e it is about e² / 2 at best, e / 2 in random order.
    """
    confidence_S, wrong_S = _samples(confidence_S, wrong_S)
    return float(_cumulative_errors(confidence_S, wrong_S).mean() / len(wrong_S))


def calibration_error(p_S_C: np.ndarray, target_S: np.ndarray, adaptive: bool = False) -> float:
    """Return the expected calibration error of the largest probability (ECE).

    The mean over `BINS` bins of |mean confidence - accuracy|, weighted by their samples. The bins are equally wide, a
    confidence of 1 in the last; or, `adaptive`, hold equally many samples.
    """
    p_S_C, target_S = _probabilities(p_S_C, target_S)
    return _binned_gap(p_S_C.max(axis=1), p_S_C.argmax(axis=1) == target_S, adaptive)


def classwise_calibration_error(p_S_C: np.ndarray, target_S: np.ndarray) -> float:
    """Return the mean over the classes of the calibration error of each class's own probability (Kull et al. 2019)."""
    p_S_C, target_S = _probabilities(p_S_C, target_S)
    return float(np.mean([_binned_gap(p_S, target_S == c, adaptive=False) for c, p_S in enumerate(p_S_C.T)]))


def negative_log_likelihood(p_S_C: np.ndarray, target_S: np.ndarray) -> float:
    """Return the mean of -ln p(true class) in nats; a probability counts as at least 1e-12."""
    p_S_C, target_S = _probabilities(p_S_C, target_S)
    return float(-np.log(np.maximum(p_S_C[np.arange(len(target_S)), target_S], 1e-12)).mean())


def brier_score(p_S_C: np.ndarray, target_S: np.ndarray) -> float:
    """Return the mean over samples of Σ_c (p_c - 1{y = c})², between 0 and 2 (Brier 1950)."""
    p_S_C, target_S = _probabilities(p_S_C, target_S)
    return float(np.square(p_S_C - np.eye(p_S_C.shape[1])[target_S]).sum(axis=1).mean())


def rank_correlation(uncertainty_S: np.ndarray, distance_S: np.ndarray) -> float:
    """Return Spearman's ρ; 0 where one of the two is constant, as it then orders nothing."""
    from scipy.stats import rankdata

    uncertainty_S, distance_S = np.asarray(uncertainty_S, float), np.asarray(distance_S, float)
    if not (np.isfinite(uncertainty_S).all() and np.isfinite(distance_S).all()):
        raise ValueError("uncertainty or distance is not finite")
    if len(uncertainty_S) < 2 or np.ptp(uncertainty_S) == 0 or np.ptp(distance_S) == 0:
        return 0.0
    return float(np.corrcoef(rankdata(uncertainty_S), rankdata(distance_S))[0, 1])


def bootstrap_interval(
    statistic: Callable[..., float],
    *samples: np.ndarray,
    random: np.random.Generator,
    resamples: int = 1000,
    level: float = 0.95,
) -> tuple[float, float]:
    """Return the percentile interval of a statistic over resamples of the S samples (Efron 1979)."""
    n = len(samples[0])
    rows_R_S = random.integers(n, size=(resamples, n))
    values_R = [statistic(*(array[rows] for array in samples)) for rows in rows_R_S]
    low, high = np.quantile(values_R, [(1 - level) / 2, (1 + level) / 2])
    return float(low), float(high)


def _cumulative_errors(confidence_S: np.ndarray, wrong_S: np.ndarray) -> np.ndarray:
    """Return the expected number of errors among the k most confident, k = 1 … S, equal confidences in random order."""
    _, group_S, size_G = np.unique(-confidence_S, return_inverse=True, return_counts=True)
    errors_G = np.bincount(group_S, weights=wrong_S, minlength=len(size_G))
    ends_G = np.concatenate([[0], np.cumsum(size_G)])
    return np.interp(np.arange(1, len(wrong_S) + 1), ends_G, np.concatenate([[0], np.cumsum(errors_G)]))


def _binned_gap(p_S: np.ndarray, hit_S: np.ndarray, adaptive: bool) -> float:
    if adaptive:
        bin_S = np.empty(len(p_S), int)
        bin_S[np.argsort(p_S, kind="stable")] = np.arange(len(p_S)) * BINS // len(p_S)
    else:
        bin_S = np.minimum((p_S * BINS).astype(int), BINS - 1)
    gaps_B = np.bincount(bin_S, weights=p_S - hit_S, minlength=BINS)
    return float(np.abs(gaps_B).sum() / len(p_S))


def _samples(confidence_S: np.ndarray, wrong_S: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    confidence_S, wrong_S = np.asarray(confidence_S, float), np.asarray(wrong_S, bool)
    if len(wrong_S) == 0 or confidence_S.shape != wrong_S.shape:
        raise ValueError(f"{confidence_S.shape} confidences of {wrong_S.shape} samples")
    if not np.isfinite(confidence_S).all():
        raise ValueError("a confidence is not finite")
    return confidence_S, wrong_S


def _probabilities(p_S_C: np.ndarray, target_S: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    p_S_C, target_S = np.asarray(p_S_C, float), np.asarray(target_S, int)
    if p_S_C.ndim != 2 or len(p_S_C) == 0 or len(p_S_C) != len(target_S):
        raise ValueError(f"probabilities of shape {p_S_C.shape} for {len(target_S)} samples")
    if not (p_S_C >= 0).all() or not np.allclose(p_S_C.sum(axis=1), 1, atol=1e-4):
        raise ValueError("probabilities are negative, not finite or do not sum to one")
    if target_S.min() < 0 or target_S.max() >= p_S_C.shape[1]:
        raise ValueError("a target is no class of the probabilities")
    return p_S_C, target_S
