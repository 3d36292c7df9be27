"""The numbers of a re-enactment that learners read."""

from __future__ import annotations

import numpy as np

from gpca.causes.shapley import ALL, SUBSETS, shapley_values
from gpca.pairs.perturbation import CONCEPTS
from gpca.reenactment.dataset import MEASURED, Reenactments

SMALLEST_ERROR = 1e-4  # diameters
SMALLEST_SUM = 0.01  # diameters, of the |φ̂| whose shares are taken
FEATURES = (
    *(f"{whose}_error_{subset}" for whose in ("first", "mean", "second") for subset in range(len(SUBSETS))),
    *(f"{whose}_phi_{concept}" for whose in ("first", "mean", "second") for concept in CONCEPTS),
    *(f"share_{concept}" for concept in CONCEPTS),
    *(f"uncertainty_{subset}" for subset in range(1, len(SUBSETS))),
    *(f"{whose}_{name}" for whose in ("first", "second") for name in MEASURED),
    *("first_weight", "second_weight", "entropy", "error_deviation", "least_error", "largest_error"),
)


def reenactment_features(reenactments: Reenactments) -> np.ndarray:
    """Return `FEATURES` (S, F), and after them the descriptors of each pair.

    Logarithms of v̂ and φ̂ of the two most probable hypotheses and of the mean over all; the shares of that mean φ̂; û,
    compressed, of the first; what was measured under both; how sure the hypotheses are, and how far v̂(all) varies.
    """
    weight_S_K, error_S_K_8 = reenactments.weight, reenactments.error
    mean_S_8 = (weight_S_K[..., None] * error_S_K_8).sum(axis=1)
    errors = [error_S_K_8[:, 0], mean_S_8, error_S_K_8[:, 1]]
    phi = [shapley_values(error_S_8) for error_S_8 in errors]
    sums = np.maximum(np.abs(phi[1]).sum(axis=1, keepdims=True), SMALLEST_SUM)
    all_S_K = error_S_K_8[..., ALL]
    deviation_S = np.sqrt((weight_S_K * (all_S_K - mean_S_8[:, ALL, None]) ** 2).sum(axis=1))
    entropy_S = -(weight_S_K * np.log(np.maximum(weight_S_K, 1e-12))).sum(axis=1)
    return np.column_stack(
        [
            *(np.log(np.maximum(error_S_8, SMALLEST_ERROR)) for error_S_8 in errors),
            *phi,
            phi[1] / sums,
            np.log1p(reenactments.uncertainty[:, 0, 1:]),
            *(reenactments.measured[:, k] for k in range(2)),
            *(weight_S_K[:, k] for k in range(2)),
            *(entropy_S, deviation_S, all_S_K.min(axis=1), all_S_K.max(axis=1)),
            reenactments.described,
        ]
    )
