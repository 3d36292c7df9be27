"""Sets of states that hold the true one with a promised probability (split conformal prediction)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from gpca.errors import InputError
from gpca.guarantee.quantile import require_share, upper_bound

Nonconformity = Literal["probability", "cumulative"]
PROBABILITY: Nonconformity = "probability"
CUMULATIVE: Nonconformity = "cumulative"


@dataclass(frozen=True)
class StateSets:
    """How sets are made of scores.

    Attributes:
        states: names of the K columns of scores.
        level: promised probability that a set holds the true state.
        nonconformity: see :func:`nonconformity`.
        by_state: whether the promise holds for the samples of each state by itself (Mondrian), not on average alone.
        limits: (K,) nonconformity up to which each state is in the set; infinite where too few samples were given, so
            that it is in every set.
    """

    states: tuple[str, ...]
    level: float
    nonconformity: Nonconformity
    by_state: bool
    limits: tuple[float, ...]

    def of(self, scores_M_K: np.ndarray) -> np.ndarray:
        """Return which states (M, K) are in the set of each of M samples; no set is empty."""
        require_scores(scores_M_K, self.states)
        inside_M_K = nonconformity(scores_M_K, self.nonconformity) <= np.array(self.limits)
        empty_M = ~inside_M_K.any(axis=1)
        inside_M_K[empty_M, scores_M_K[empty_M].argmax(axis=1)] = True
        return inside_M_K


def nonconformity(scores_N_K: np.ndarray, kind: Nonconformity) -> np.ndarray:
    """Return how ill each state fits each sample (N, K).

    - ``probability``: 1 minus its score (Sadinle, Lei and Wasserman 2019), which makes the smallest sets;
    - ``cumulative``: the sum of the scores that are as large as its own or larger (Romano, Sesia and Candès 2020,
      without randomization), which covers samples that are hard to tell more evenly.
    """
    if kind == PROBABILITY:
        return 1 - scores_N_K
    if kind != CUMULATIVE:
        raise InputError(f"nonconformity '{kind}'", "unknown", f"choose {PROBABILITY} or {CUMULATIVE}")
    as_large_N_K_K = scores_N_K[:, None, :] >= scores_N_K[:, :, None]
    return (as_large_N_K_K * scores_N_K[:, None, :]).sum(axis=2)


def calibrate_sets(
    scores_N_K: np.ndarray,
    state_N: np.ndarray,
    family_N: np.ndarray | None,
    states: Sequence[str],
    level: float,
    kind: Nonconformity = PROBABILITY,
    by_state: bool = False,
) -> StateSets:
    """Return the sets that hold the true state of a further sample with a probability of at least `level`.

    Args:
        scores_N_K: of samples that nothing was learned from.
        state_N: their true states.
        family_N: of every sample; see :func:`gpca.guarantee.quantile.upper_bound`.

    Raises:
        InputError: scores of another shape or not finite, a state that is none of `states`, a level that is no share.
    """
    require_share("level of the sets", level)
    require_scores(scores_N_K, states)
    is_state_N_K = np.asarray(state_N)[:, None] == np.array(states)
    if not (known_N := is_state_N_K.any(axis=1)).all():
        raise InputError(f"state '{state_N[~known_N][0]}'", "unknown", f"choose one of {', '.join(states)}")
    number_N = is_state_N_K.argmax(axis=1)
    own_N = nonconformity(scores_N_K, kind)[np.arange(len(number_N)), number_N]

    def limit(rows_N: np.ndarray) -> float:
        return upper_bound(own_N[rows_N], level, None if family_N is None else family_N[rows_N])

    if by_state:
        limits = tuple(limit(number_N == number) for number in range(len(states)))
    else:
        limits = (limit(np.ones(len(own_N), bool)),) * len(states)
    return StateSets(tuple(states), level, kind, by_state, limits)


def require_scores(scores_N_K: np.ndarray, states: Sequence[str]) -> None:
    """Raise an InputError unless there is a finite score for each sample and state."""
    if scores_N_K.ndim != 2 or scores_N_K.shape[1] != len(states) or not np.isfinite(scores_N_K).all():
        fault = f"have the shape {scores_N_K.shape} or are not finite"
        raise InputError("scores", fault, f"give a finite number for each of {', '.join(states)}")
