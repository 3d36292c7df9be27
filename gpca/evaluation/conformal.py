"""Conformal bounds, sets of states that contain the true one, and an alarm with two bounded risks.

No distribution is assumed. Samples have to be exchangeable with a new one: either sample by sample, or family by family
of similar shapes, where the new sample belongs to a new family.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, inf

import numpy as np

from gpca.errors import InputError

ROUNDING = 1e-9  # tolerance of a sum of weights
GOOD, NOT_SURE, ALARM = OUTCOMES = ("good", "not sure", "failed")


def upper_bound(value_N: np.ndarray, level: float, family_N: np.ndarray | None = None) -> float:
    """Return a bound that a new sample exceeds with a probability of at most 1 - `level`; infinity for too few samples.

    Sample by sample, it is the value of rank ⌈(N + 1) level⌉ (Vovk et al. 2005). Family by family, each of K families
    has the weight 1 / (K + 1), distributed equally over its samples; the new sample's family, whose values are
    arbitrary, has the same weight (hierarchical conformal prediction, Lee, Barber and Willett 2023).
    """
    if family_N is None:
        rank = ceil((len(value_N) + 1) * level - ROUNDING)
        return float(np.sort(value_N)[rank - 1]) if rank <= len(value_N) else inf
    _, number_N, size_K = np.unique(family_N, return_inverse=True, return_counts=True)
    weight_N = 1 / (size_K[number_N] * (len(size_K) + 1))
    order = np.argsort(value_N, kind="stable")
    enough_N = np.cumsum(weight_N[order]) >= level - ROUNDING
    return float(value_N[order][enough_N.argmax()]) if enough_N.any() else inf


def highest_level(family_N: np.ndarray) -> float:
    """Return the largest level with a finite :func:`upper_bound` by K families, K / (K + 1)."""
    return (count := len(np.unique(family_N))) / (count + 1)


@dataclass(frozen=True)
class StateSets:
    """Sets of states by limits on 1 - score (Sadinle, Lei and Wasserman 2019), infinite for too few samples."""

    states: tuple[str, ...]  # names of the K columns of scores
    level: float  # probability that a set contains the true state
    by_state: bool  # whether the level holds for each state separately (Mondrian) instead of on average
    limits: tuple[float, ...]  # (K,) largest of each state in a set

    def of(self, scores_M_K: np.ndarray) -> np.ndarray:
        """Return which states (M, K) are in the set of each of M samples; no set is empty."""
        require_scores(scores_M_K, self.states)
        inside_M_K = 1 - scores_M_K <= np.array(self.limits)
        empty_M = ~inside_M_K.any(axis=1)
        inside_M_K[empty_M, scores_M_K[empty_M].argmax(axis=1)] = True
        return inside_M_K


def calibrate_sets(
    scores_N_K: np.ndarray,
    state_N: np.ndarray,
    family_N: np.ndarray | None,
    states: Sequence[str],
    level: float,
    by_state: bool = False,
) -> StateSets:
    """Calibrate sets that contain the true state of a new sample with a probability of at least `level`."""
    require_share("level of the sets", level)
    require_scores(scores_N_K, states)
    number_N = (np.asarray(state_N)[:, None] == np.array(states)).argmax(axis=1)
    value_N = 1 - scores_N_K[np.arange(len(number_N)), number_N]
    masks = [number_N == number if by_state else np.ones(len(value_N), bool) for number in range(len(states))]
    limits = (upper_bound(value_N[mask_N], level, None if family_N is None else family_N[mask_N]) for mask_N in masks)
    return StateSets(tuple(states), level, by_state, tuple(limits))


@dataclass(frozen=True)
class FailureAlarm:
    """An alarm with two thresholds, infinite where there were too few samples; between them, it is not sure."""

    missed: float  # largest probability that a failed registration is called good
    false_alarms: float  # largest probability that a good one is called failed
    good_below: float  # score of failure below which a registration is called good
    failed_from: float  # score from which it is called failed

    def of(self, failure_M: np.ndarray) -> np.ndarray:
        """Return the call of each registration, one of `OUTCOMES`, by its score of failure."""
        return np.select([failure_M < self.good_below, failure_M >= self.failed_from], [GOOD, ALARM], NOT_SURE)


def calibrate_alarm(
    failure_N: np.ndarray,
    failed_N: np.ndarray,
    family_N: np.ndarray | None = None,
    missed: float = 0.05,
    false_alarms: float = 0.05,
) -> FailureAlarm:
    """Calibrate an alarm with these largest risks.

    A failure is missed with at most the probability that its score lies below the bound that failures seldom fall below
    (conformal risk control, Angelopoulos et al. 2024, of a loss of 0 or 1); false alarms likewise. If the bounds leave
    a gap in which both calls are allowed, its middle becomes the only threshold. No sample may have been used for
    training.
    """
    require_share("risk of missed failures", missed)
    require_share("risk of false alarms", false_alarms)

    def bound(value_N: np.ndarray, mask_N: np.ndarray, risk: float) -> float:
        return upper_bound(value_N[mask_N], 1 - risk, None if family_N is None else family_N[mask_N])

    good_below = -bound(-failure_N, failed_N, missed)
    failed_from = float(np.nextafter(bound(failure_N, ~failed_N, false_alarms), inf))
    if good_below > failed_from:
        good_below = failed_from = (good_below + failed_from) / 2
    return FailureAlarm(missed, false_alarms, good_below, failed_from)


def require_share(name: str, share: float) -> None:
    if not 0 < share < 1:
        raise InputError(name, f"{share} is not strictly between 0 and 1", "give a share such as 0.9 or 0.05")


def require_scores(scores_N_K: np.ndarray, states: Sequence[str]) -> None:
    if scores_N_K.ndim != 2 or scores_N_K.shape[1] != len(states) or not np.isfinite(scores_N_K).all():
        fault = f"have the shape {scores_N_K.shape} or are not finite"
        raise InputError("scores", fault, f"give a finite number for each of {', '.join(states)}")
