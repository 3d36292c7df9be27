"""Chances, learned on the training tables: that a pose is right as it is, and that an action mends a wrong one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gpca.recovery.policy import NOTHING, QUEUE, Decision

INVERSE_REGULARizATION = 0.3  # chosen on failures of development seeds


@dataclass(frozen=True)
class Trial:
    """One try of an action: what was known of the registration, and whether its pose was right afterward.

    Attributes:
        known_F: see :func:`gpca.experiments.recovery.rehearsal.known`.
        action: its name; `NOTHING` where the registration was left as it was.
    """

    known_F: np.ndarray
    action: str
    right: bool


class Chances:
    """A logistic regression for each action, and one for doing nothing, on standardized numbers.

    An action that always or never helped in the trials gets the rate of Laplace's rule of succession.

    Args:
        trials: of the training tables.
        inverse_regularisation: of the weights (C of scikit-learn); the smaller, the nearer to each action's own rate.
    """

    def __init__(
        self, trials: Sequence[Trial], actions: Sequence[str], inverse_regularisation: float = INVERSE_REGULARizATION
    ) -> None:
        self._models = {
            name: _fitted([trial for trial in trials if trial.action == name], inverse_regularisation)
            for name in (NOTHING, *actions)
        }

    def of(self, name: str, known_F: np.ndarray) -> float:
        """Return the probability that the pose is right after the action, or as it is for `NOTHING`."""
        model = self._models[name]
        return model if isinstance(model, float) else float(model.predict_proba(known_F[None])[0, 1])


def learn_utility(
    trials: Iterable[Sequence[Trial]], costs: Mapping[str, float], actions: Sequence[str], needless: float = 0.0
) -> ExpectedUtility:
    """Return the policy learned from the trials of these episodes."""
    together = [trial for of_episode in trials for trial in of_episode]
    return ExpectedUtility(Chances(together, actions), {action: costs[action] for action in actions}, needless)


def _fitted(trials: Sequence[Trial], inverse_regularisation: float) -> Any:
    from gpca.explainers.classifiers import standardized_regression

    right_N = np.array([trial.right for trial in trials], bool)
    if right_N.all() or not right_N.any():
        return float((right_N.sum() + 1) / (len(right_N) + 2))
    return standardized_regression(inverse_regularisation).fit(np.array([trial.known_F for trial in trials]), right_N)


@dataclass(frozen=True)
class ExpectedUtility:
    """Takes the action whose success is worth most by what it costs, and none that is not worth it.

    A right pose is worth 1. With the chance p that the pose is right as it is and the chance p_a that action a makes a
    wrong one right, the action gains (1 - p) p_a - p b - c_a over doing nothing, where b is what it costs to act
    needlessly. The k actions of the largest p_a also have the largest chance that any of k helps (if they help
    independently of each other, given what is known), so that one order is best for every budget k where costs are
    alike.

    Attributes:
        chances: learned on the training tables.
        costs: action -> c_a, in right poses.
        needless: b, in right poses.
    """

    chances: Chances
    costs: Mapping[str, float]
    needless: float = 0.0

    def decide(self, known_F: np.ndarray, before: Iterable[str], alarmed: bool = False) -> Decision:
        """Choose the next action.

        An action that was taken without success comes again only after all others. A robot that is asked again knows
        that its pose is wrong yet, as one does that was alarmed.
        """
        before = list(before)
        wrong = alarmed or bool(before)
        fewest = min(before.count(action) for action in self.costs)
        gains = self.gains(known_F, 0.0 if wrong else self.chances.of(NOTHING, known_F))
        best = max((action for action in gains if before.count(action) == fewest), key=lambda action: gains[action])
        if gains[best] > 0:
            return Decision(best, "", f"{best} gains {gains[best]:.2f}")
        return Decision(QUEUE if wrong else NOTHING, "", f"no action is worth its cost: {best} {gains[best]:.2f}")

    def gains(self, known_F: np.ndarray, right: float) -> dict[str, float]:
        """Return what each action gains over doing nothing, where the pose is right with this chance."""
        certain = right * self.needless
        return {a: (1 - right) * self.chances.of(a, known_F) - certain - cost for a, cost in self.costs.items()}
