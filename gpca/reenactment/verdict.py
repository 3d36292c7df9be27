"""What an enactment says without any training: the probability that nothing is wrong, and that of each cause."""

from __future__ import annotations

import numpy as np
from scipy.special import expit

from gpca.causes.settings import Limits
from gpca.causes.shapley import ALL, shapley_values

STEEPNESS = 8.0  # of the probability of a failure in the logarithm of v̂
SMALLEST_ERROR = 1e-4  # diameters


def verdict(error_S_K_8: np.ndarray, weight_S_K: np.ndarray, limits: Limits) -> np.ndarray:
    """Return the probabilities (S, 4) of nominal and of each cause to be the dominant one, of S pairs.

    Under each of K hypotheses a failure is as probable as not where v̂(all) is midway between the limits, and φ̂ is known
    up to the limit of a cause: P(cause) is its softmax at that temperature. Hypotheses are weighted by how probable
    they are.

    Args:
        error_S_K_8: v̂.
        weight_S_K: probabilities of the hypotheses, 0 where there is none.
    """
    middle = np.sqrt(limits.nominal * limits.failed)
    failed_S_K = expit(STEEPNESS * np.log(np.maximum(error_S_K_8[..., ALL], SMALLEST_ERROR) / middle))
    phi_S_K_3 = shapley_values(error_S_K_8.reshape(-1, ALL + 1)).reshape(*weight_S_K.shape, -1)
    share_S_K_3 = np.exp((phi_S_K_3 - phi_S_K_3.max(axis=2, keepdims=True)) / limits.cause)
    share_S_K_3 /= share_S_K_3.sum(axis=2, keepdims=True)
    causes_S_3 = (weight_S_K[..., None] * failed_S_K[..., None] * share_S_K_3).sum(axis=1)
    return np.column_stack([1 - causes_S_3.sum(axis=1), causes_S_3])
