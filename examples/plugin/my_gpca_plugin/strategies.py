"""A strategy of active learning."""

from __future__ import annotations

import numpy as np

from gpca.active_learning.acquisition import Pool, Strategy, top


def least_confident(pool: Pool, batch: int, _random: np.random.Generator) -> np.ndarray:
    """Take the samples whose largest score is the smallest."""
    return top(-pool.scores_N_C.max(axis=1), batch)


STRATEGIES = {"my_least_confident": Strategy("Least confident (mine)", least_confident)}
