"""The guarantee of an explainer of causes: sets of states and an alarm, calibrated on unseen families."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from math import inf, isfinite
from typing import Any

import numpy as np

from gpca.causes.dataset import LABELS, labels_of
from gpca.causes.truth import BORDERLINE, FAILED, NOMINAL, Truth
from gpca.errors import InputError
from gpca.evaluation import conformal
from gpca.evaluation.conformal import FailureAlarm, StateSets

SEVERAL = "several"
STATES = (*LABELS, SEVERAL)
WHETHER_FAILED = (NOMINAL, FAILED)  # states of samples whose causes are not known
BOUNDS = {"good_below": -inf, "failed_from": inf}  # of an alarm; the values stand as None in files
REMEDY = "calibrate it again"


@dataclass(frozen=True)
class Guarantee:
    """Calibrated sets of states and alarm."""

    state_sets: StateSets
    failure_alarm: FailureAlarm
    samples: int
    families: int  # number of families it was calibrated on; 0 if samples were exchangeable one by one
    labeled: bool = False  # whether a user labeled the samples

    def sets(self, scores_M_K: np.ndarray) -> np.ndarray:
        """Return which states (M, K) are in the set of each of M registrations, by scores of these or of `STATES`."""
        if self.state_sets.states == WHETHER_FAILED:
            scores_M_K = whether_failed(scores_M_K)
        return self.state_sets.of(scores_M_K)

    def alarm(self, failure_M: np.ndarray) -> np.ndarray:
        """Return the call of each registration (M,), one of :data:`gpca.evaluation.conformal.OUTCOMES`."""
        return self.failure_alarm.of(failure_M)

    def within(self, threshold: float) -> float:
        """Return the threshold of failure nearest to this one at which no state contradicts a call of the alarm."""
        return min(max(threshold, self.failure_alarm.good_below), self.failure_alarm.failed_from)

    def more_cautious(self, other: Guarantee) -> Guarantee | None:
        """Return the larger sets and the rarer calls of two guarantees; None if they are of different states."""
        if self.state_sets.states != other.state_sets.states:
            return None
        one, two = self.failure_alarm, other.failure_alarm
        limits = tuple(map(max, self.state_sets.limits, other.state_sets.limits))
        failed_from = max(one.failed_from, two.failed_from)
        alarm = replace(one, good_below=min(one.good_below, two.good_below), failed_from=failed_from)
        return replace(self, state_sets=replace(self.state_sets, limits=limits), failure_alarm=alarm)

    def to_dict(self) -> dict[str, Any]:
        """Return numbers, words and lists, with None for infinite bounds."""
        sets, alarm = asdict(self.state_sets), asdict(self.failure_alarm)
        sets |= {"states": list(sets["states"]), "limits": [x if isfinite(x) else None for x in sets["limits"]]}
        alarm |= {name: alarm[name] if isfinite(alarm[name]) else None for name in BOUNDS}
        counts = {"samples": self.samples, "families": self.families, "labeled": self.labeled}
        return {"sets": sets, "alarm": alarm, **counts}

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> Guarantee:
        """Invert :meth:`to_dict`, also of files that name the kind of sets; an InputError for wrong values."""
        try:
            sets, alarm = dict(plain["sets"]), dict(plain["alarm"])
            alarm.pop("confidence", None)
            if (kind := sets.pop("nonconformity", "probability")) != "probability":
                raise ValueError(f"sets by {str(kind)[:40]}")
            limits = tuple(inf if x is None else float(x) for x in sets["limits"])
            bounds = {name: none if alarm[name] is None else float(alarm[name]) for name, none in BOUNDS.items()}
            state_sets = StateSets(**{**sets, "states": tuple(sets["states"]), "limits": limits})
            counts = int(plain["samples"]), int(plain["families"]), bool(plain.get("labeled"))
            read = cls(state_sets, FailureAlarm(**{**alarm, **bounds}), *counts)
        except (KeyError, TypeError, ValueError) as fault:
            raise InputError("guarantee", f"is damaged ({type(fault).__name__}: {fault})", REMEDY) from fault
        if len(limits) != len(state_sets.states):
            raise InputError("guarantee", "has not one limit for each state", REMEDY)
        return read


def calibrate(
    scores_N_K: np.ndarray,
    state_N: np.ndarray,
    family_N: np.ndarray | None = None,
    *,
    states: Sequence[str] = STATES,
    level: float = 0.9,
    missed: float = 0.05,
    false_alarms: float = 0.05,
    by_state: bool = False,
) -> Guarantee:
    """Calibrate the guarantee for a new sample on samples that were not used for training.

    With K exchangeable families, it holds for a new one at a level of at most K / (K + 1); without, for exchangeable
    samples. Scores (N, K) are of the states, of which the first is nominal; ``borderline`` samples are left out.
    """
    state_N = np.asarray(state_N)
    if len(state_N) != len(scores_N_K) or (family_N is not None and len(family_N) != len(state_N)):
        fault = "have other numbers of scores, states and families"
        raise InputError("samples to calibrate on", fault, "give one each")
    clear_N = state_N != BORDERLINE
    family_n = None if family_N is None else np.asarray(family_N)[clear_N]
    scores_n_K, state_n = np.asarray(scores_N_K, float)[clear_N], state_N[clear_N]
    sets = conformal.calibrate_sets(scores_n_K, state_n, family_n, states, level, by_state)
    alarm = conformal.calibrate_alarm(1 - scores_n_K[:, 0], state_n != states[0], family_n, missed, false_alarms)
    return Guarantee(sets, alarm, len(state_n), 0 if family_n is None else len(np.unique(family_n)))


def whether_failed(scores_M_K: np.ndarray) -> np.ndarray:
    return np.column_stack([scores_M_K[:, 0], 1 - scores_M_K[:, 0]])


def states_of(truth: Truth) -> np.ndarray:
    """Return the state (S,) of registrations; a failure with at most one cause has its dominant cause."""
    label_S = labels_of(truth)
    failed_S = (label_S != NOMINAL) & (label_S != BORDERLINE)
    return np.where(failed_S & (truth.causes.sum(axis=1) > 1), SEVERAL, label_S)


def state_scores(scores_N_4: np.ndarray) -> np.ndarray:
    """Return scores (N, 5) of `STATES` that sum to 1, from the scores of nominal and of the three causes.

    Causes are normalized to shares s: a failure has the single cause c with probability s_c², several with 1 - Σ s_c².
    """
    conformal.require_scores(scores_N_4, LABELS)
    nominal_N = np.clip(scores_N_4[:, 0], 0, 1)
    causes_N_3 = np.maximum(scores_N_4[:, 1:], 0)
    sum_N_1 = causes_N_3.sum(axis=1, keepdims=True)
    share_N_3 = np.where(sum_N_1 > 0, causes_N_3 / np.where(sum_N_1 > 0, sum_N_1, 1), 1 / causes_N_3.shape[1])
    both_N_3 = share_N_3**2
    failed_N_1 = 1 - nominal_N[:, None]
    several_N_1 = np.maximum(1 - both_N_3.sum(axis=1, keepdims=True), 0)
    return np.column_stack([nominal_N, failed_N_1 * both_N_3, failed_N_1 * several_N_1])
