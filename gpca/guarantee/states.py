"""The states that a set is of: nothing is wrong, one cause, or several; and what scores of causes say of them."""

from __future__ import annotations

import numpy as np

from gpca.causes.dataset import LABELS, labels_of
from gpca.causes.truth import BORDERLINE, NOMINAL, Truth
from gpca.errors import InputError

SEVERAL = "several"
STATES = (*LABELS, SEVERAL)


def states_of(truth: Truth) -> np.ndarray:
    """Return (S,) the state of each registration: of `STATES`, or ``borderline`` where it has no label.

    A failed registration with one cause, or none above the limit of a cause, has that of its dominant one.
    """
    label_S = labels_of(truth)
    failed_S = (label_S != NOMINAL) & (label_S != BORDERLINE)
    return np.where(failed_S & (truth.causes.sum(axis=1) > 1), SEVERAL, label_S)


def state_scores(scores_N_4: np.ndarray) -> np.ndarray:
    """Return scores (N, 5) of `STATES` that add up to 1, from those of nominal and of the three causes.

    The scores of the causes are taken for shares. Of a failure with shares s, one cause c is as probable as that two
    draws from them both name c, s_c², and several that they differ, 1 - Σ s_c². No set is wrong because of this rule;
    a better one would make sets smaller.

    Raises:
        InputError: scores of another shape, or that are not finite.
    """
    if scores_N_4.ndim != 2 or scores_N_4.shape[1] != len(LABELS) or not np.isfinite(scores_N_4).all():
        fault = f"have the shape {scores_N_4.shape} or are not finite"
        raise InputError("scores", fault, f"give a finite number for each of {', '.join(LABELS)}")
    nominal_N = np.clip(scores_N_4[:, 0], 0, 1)
    causes_N_3 = np.maximum(scores_N_4[:, 1:], 0)
    sum_N_1 = causes_N_3.sum(axis=1, keepdims=True)
    share_N_3 = np.where(sum_N_1 > 0, causes_N_3 / np.where(sum_N_1 > 0, sum_N_1, 1), 1 / causes_N_3.shape[1])
    both_N_3 = share_N_3**2
    failed_N_1 = 1 - nominal_N[:, None]
    several_N_1 = np.maximum(1 - both_N_3.sum(axis=1, keepdims=True), 0)
    return np.column_stack([nominal_N, failed_N_1 * both_N_3, failed_N_1 * several_N_1])
