"""The states of a registration: nominal, one cause, or several; and their scores."""

from __future__ import annotations

import numpy as np

from gpca.causes.dataset import LABELS, labels_of
from gpca.causes.truth import BORDERLINE, NOMINAL, Truth
from gpca.guarantee.conformal import require_scores

SEVERAL = "several"
STATES = (*LABELS, SEVERAL)


def states_of(truth: Truth) -> np.ndarray:
    """Return the state (S,) of each registration: one of `STATES`, or ``borderline`` if it has no label.

    A failure with at most one cause above the limit has the state of its dominant cause.
    """
    label_S = labels_of(truth)
    failed_S = (label_S != NOMINAL) & (label_S != BORDERLINE)
    return np.where(failed_S & (truth.causes.sum(axis=1) > 1), SEVERAL, label_S)


def state_scores(scores_N_4: np.ndarray) -> np.ndarray:
    """Return scores (N, 5) of `STATES` that sum to 1, from the scores of nominal and of the three causes.

    The scores of the causes are normalized to shares s. A failure has the single cause c with the probability s_c² that
    two draws from the shares both give c, and several causes with 1 - Σ s_c². Sets are valid with any such rule; a
    better one would make them smaller.
    """
    require_scores(scores_N_4, LABELS)
    nominal_N = np.clip(scores_N_4[:, 0], 0, 1)
    causes_N_3 = np.maximum(scores_N_4[:, 1:], 0)
    sum_N_1 = causes_N_3.sum(axis=1, keepdims=True)
    share_N_3 = np.where(sum_N_1 > 0, causes_N_3 / np.where(sum_N_1 > 0, sum_N_1, 1), 1 / causes_N_3.shape[1])
    both_N_3 = share_N_3**2
    failed_N_1 = 1 - nominal_N[:, None]
    several_N_1 = np.maximum(1 - both_N_3.sum(axis=1, keepdims=True), 0)
    return np.column_stack([nominal_N, failed_N_1 * both_N_3, failed_N_1 * several_N_1])
