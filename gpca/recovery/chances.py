"""Probabilities learned on the training tables: of a failure, and that an action makes a wrong pose right."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gpca.causes.policy import NOTHING, QUEUE, Decision
from gpca.errors import InputError
from gpca.evaluation.conformal import upper_bound
from gpca.explainers.classifiers import standardized_regression

INVERSE_REGULARIZATION = 0.3  # C of scikit-learn, chosen on development seeds; smaller is closer to the mean rate
FOLDS = 8  # of the tables


@dataclass(frozen=True)
class FailureGate:
    """A classifier of failures, without causes, and the probability above which it raises an alarm."""

    classifier: Any
    threshold: float = 0.5

    def failure(self, observed_N_F: np.ndarray) -> np.ndarray:
        """Return the probability (N,) that each registration failed."""
        return self.classifier.predict_proba(observed_N_F)[:, 1]

    def alarms(self, observed_F: np.ndarray) -> bool:
        """Return whether the registration counts as failed."""
        return bool(self.failure(observed_F[None])[0] > self.threshold)


def learn_gate(observed_N_F: np.ndarray, failed_N: np.ndarray, table_N: Sequence, false_alarms: float) -> FailureGate:
    """Train a gate; its threshold is set on good registrations, each judged by a classifier without their table."""
    good_N = ~failed_N
    _, group_N = np.unique([str(table) for table in table_N], return_inverse=True)
    for kind, mask_N in (("failed", failed_N), ("good", good_N)):
        if (tables := len(set(group_N[mask_N]))) < 2:
            fault = f"{kind} training registrations stand on {tables} of the two tables that a gate needs at least"
            raise InputError("recovery", fault, "raise recovery.train, recovery.rehearsals or recovery.tables")

    def fitted(rows_N: np.ndarray) -> FailureGate:
        regression = standardized_regression(INVERSE_REGULARIZATION)
        return FailureGate(regression.fit(observed_N_F[rows_N], failed_N[rows_N]))

    fold_N = group_N % FOLDS
    failure_N = np.full(len(failed_N), np.nan)
    for fold in np.unique(fold_N[good_N]):
        held_out_N = fold_N == fold
        failure_N[held_out_N] = fitted(~held_out_N).failure(observed_N_F[held_out_N])
    threshold = alarm_threshold(failure_N[good_N], false_alarms)
    return replace(fitted(np.ones(len(failed_N), bool)), threshold=threshold)


def alarm_threshold(failure_M: np.ndarray, false_alarms: float) -> float:
    """Return the conformal threshold that so few new good registrations exceed, or the largest of a few scores."""
    return min(upper_bound(failure_M, 1 - false_alarms), float(failure_M.max()))


@dataclass(frozen=True)
class Trial:
    """A rehearsed action."""

    known_F: np.ndarray  # see :func:`gpca.recovery.loop.policy_inputs`
    action: str  # its name; `NOTHING` if the registration was left as it was
    right: bool  # whether the pose was right afterwards


class Chances:
    """A logistic regression per action and for doing nothing; Laplace's rate for one that always or never succeeded."""

    def __init__(self, trials: Sequence[Trial], actions: Sequence[str]) -> None:
        self._models: dict[str, Any] = {}
        for name in (NOTHING, *actions):
            rows = [trial for trial in trials if trial.action == name]
            right_N = np.array([trial.right for trial in rows], bool)
            if right_N.all() or not right_N.any():
                self._models[name] = float((right_N.sum() + 1) / (len(right_N) + 2))
            else:
                regression = standardized_regression(INVERSE_REGULARIZATION)
                self._models[name] = regression.fit(np.array([trial.known_F for trial in rows]), right_N)

    def of(self, name: str, known_F: np.ndarray) -> float:
        """Return the probability that the pose is right after the action, or as it is for `NOTHING`."""
        model = self._models[name]
        return model if isinstance(model, float) else float(model.predict_proba(known_F[None])[0, 1])


def learn_utility(
    trials: Iterable[Sequence[Trial]], costs: Mapping[str, float], actions: Sequence[str], needless: float = 0.0
) -> ExpectedUtility:
    joined = [trial for episode in trials for trial in episode]
    return ExpectedUtility(Chances(joined, actions), {action: costs[action] for action in actions}, needless)


@dataclass(frozen=True)
class ExpectedUtility:
    """Takes the action with the largest expected gain, if it is positive.

    A right pose is worth 1. If the pose is right with probability p, and action a makes a wrong one right with
    probability p_a, it gains (1 - p) p_a - p b - c_a, where b is the cost of acting needlessly.
    """

    chances: Chances  # p and p_a, learned on the training tables
    costs: Mapping[str, float]  # c_a of each action, in right poses
    needless: float = 0.0  # b

    def decide(self, known_F: np.ndarray, before: Iterable[str], alarmed: bool = False) -> Decision:
        """Choose the next action, each anew after all others; after one, or an alarm, the pose is taken to be wrong."""
        before = list(before)
        wrong = alarmed or bool(before)
        fewest = min(before.count(action) for action in self.costs)
        gains = self.gains(known_F, 0.0 if wrong else self.chances.of(NOTHING, known_F))
        best = max((action for action in gains if before.count(action) == fewest), key=lambda action: gains[action])
        if gains[best] > 0:
            return Decision(best, "", f"{best} gains {gains[best]:.2f}")
        return Decision(QUEUE if wrong else NOTHING, "", f"no action is worth its cost: {best} {gains[best]:.2f}")

    def gains(self, known_F: np.ndarray, right: float) -> dict[str, float]:
        """Return the gain of each action over doing nothing, where the pose is right with this probability."""
        certain = right * self.needless
        return {a: (1 - right) * self.chances.of(a, known_F) - certain - cost for a, cost in self.costs.items()}
