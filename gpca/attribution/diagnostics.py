"""The worth of an explainer's uncertainty: whether it separates right from wrong, and whether it is calibrated.

Of S test samples: ``wrong_S`` whether each was named wrongly, ``confidence_S`` any score that is higher where the
explainer is surer, ``p_S_C`` class probabilities and ``target_S`` the numbers of the true classes.
"""

import numpy as np

from gpca.evaluation.intervals import mean_ranks

BINS = 15  # calibration errors are measured over so many (Guo et al. 2017)
LEAST_PROBABILITY = 1e-12  # that a true class counts with


def risk_coverage(confidence_S: np.ndarray, wrong_S: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return coverage k / S and risk, the share of errors among the k most confident samples, for k = 1 … S."""
    k_S = np.arange(1, len(wrong_S) + 1)
    return k_S / len(wrong_S), _cumulative_errors(confidence_S, wrong_S) / k_S


def aurc(confidence_S: np.ndarray, wrong_S: np.ndarray) -> float:
    """Return the area under the risk-coverage curve, the mean of its S risks (Geifman et al. 2019); least is best."""
    return float(risk_coverage(confidence_S, wrong_S)[1].mean())


def excess_aurc(confidence_S: np.ndarray, wrong_S: np.ndarray) -> float:
    """Return the area minus the least that these errors allow, with all of them last (E-AURC); 0 is best."""
    return aurc(confidence_S, wrong_S) - aurc(~wrong_S, wrong_S)


def augrc(confidence_S: np.ndarray, wrong_S: np.ndarray) -> float:
    """Return the area under the generalized risk, errors among the k most confident over S (Traub et al. 2024)."""
    return float(_cumulative_errors(confidence_S, wrong_S).mean() / len(wrong_S))


def calibration_error(p_S_C: np.ndarray, target_S: np.ndarray) -> float:
    """Return the expected calibration error of the largest probability (ECE).

    The mean over `BINS` equally wide bins of |mean confidence - accuracy|, weighted by their samples.
    """
    p_S, hit_S = p_S_C.max(axis=1), p_S_C.argmax(axis=1) == target_S
    bin_S = np.minimum((p_S * BINS).astype(int), BINS - 1)  # a confidence of 1 is in the last
    return float(np.abs(np.bincount(bin_S, weights=p_S - hit_S, minlength=BINS)).sum() / len(p_S))


def negative_log_likelihood(p_S_C: np.ndarray, target_S: np.ndarray) -> float:
    return float(-np.log(np.maximum(p_S_C[np.arange(len(target_S)), target_S], LEAST_PROBABILITY)).mean())


def brier_score(p_S_C: np.ndarray, target_S: np.ndarray) -> float:
    """Return the mean over samples of Σ_c (p_c - 1{y = c})², between 0 and 2 (Brier 1950)."""
    return float(np.square(p_S_C - np.eye(p_S_C.shape[1])[target_S]).sum(axis=1).mean())


def rank_correlation(uncertainty_S: np.ndarray, distance_S: np.ndarray) -> float:
    """Return Spearman's ρ; 0 where one of the two is constant, as it then orders nothing."""
    if len(uncertainty_S) < 2 or np.ptp(uncertainty_S) == 0 or np.ptp(distance_S) == 0:
        return 0.0
    return float(np.corrcoef(mean_ranks(uncertainty_S), mean_ranks(distance_S))[0, 1])


def _cumulative_errors(confidence_S: np.ndarray, wrong_S: np.ndarray) -> np.ndarray:
    """Return the expected number of errors among the k most confident, k = 1 … S, equal confidences in random order."""
    _, group_S, size_G = np.unique(-np.asarray(confidence_S, float), return_inverse=True, return_counts=True)
    errors_G = np.bincount(group_S, weights=wrong_S, minlength=len(size_G))
    ends_G = np.concatenate([[0], np.cumsum(size_G)])
    return np.interp(np.arange(1, len(wrong_S) + 1), ends_G, np.concatenate([[0], np.cumsum(errors_G)]))
