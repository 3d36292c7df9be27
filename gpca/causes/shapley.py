"""Exact Shapley values of the three concepts: the share that each has in the outcome.

A worth is given for all eight subsets of the concepts; subset b has concept i where bit i of b is set.
"""

from __future__ import annotations

import numpy as np

from gpca.pairs.perturbation import CONCEPTS

SUBSETS = tuple(tuple(i for i in range(len(CONCEPTS)) if subset >> i & 1) for subset in range(2 ** len(CONCEPTS)))
NONE, ALL = 0, len(SUBSETS) - 1
BY_SIZE = tuple(sorted(range(len(SUBSETS)), key=lambda subset: (len(SUBSETS[subset]), subset)))  # as figures show them
# Of a value, by how many of the other concepts are present: |S|! (2 − |S|)! / 3!
WEIGHTS = (1 / 3, 1 / 6, 1 / 3)


def shapley_values(worth_S_8: np.ndarray) -> np.ndarray:
    """Return φ (S, 3) of the concepts, φ_i = Σ_{S ∌ i} |S|! (2 − |S|)! / 3! (v(S ∪ i) − v(S)).

    They add up to v(all) − v(none). ``baselines.shap_kl`` leaves the same to the shap library, as users of SHAP do.
    """
    phi_S_3 = np.zeros((len(worth_S_8), len(CONCEPTS)))
    for i in range(len(CONCEPTS)):
        for subset, present in enumerate(SUBSETS):
            if i not in present:
                gain_S = worth_S_8[:, subset | 1 << i] - worth_S_8[:, subset]
                phi_S_3[:, i] += WEIGHTS[len(present)] * gain_S
    return phi_S_3
