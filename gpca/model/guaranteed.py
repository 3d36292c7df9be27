"""What a model promises of one registration: a set that holds its state, and a call with bounded errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gpca.explainers.pair_classifier import Judgment
from gpca.guarantee.alarm import ALARM, GOOD
from gpca.guarantee.guarantee import Guarantee
from gpca.guarantee.states import SEVERAL

SMALLEST = 1e-9  # probability of a cause
IN_WORDS = {SEVERAL: "several causes"}


@dataclass(frozen=True)
class Guaranteed:
    """The promises, as :mod:`gpca.guarantee` makes them.

    Attributes:
        states: that the registration may be in.
        level: probability that they hold the true one.
        call: good, not sure or failed.
        missed, false_alarms: largest probability that a failure is called good, and a good one failed.
        families: of shapes that the set was calibrated on; 0 where single registrations were counted.
    """

    states: tuple[str, ...]
    level: float
    call: str
    missed: float
    false_alarms: float
    families: int

    @classmethod
    def of(cls, guarantee: Guarantee, scores_1_K: np.ndarray) -> Guaranteed:
        """Return what is promised of a registration with these scores of the states."""
        names, alarm = guarantee.state_sets.states, guarantee.failure_alarm
        inside_K = guarantee.sets(scores_1_K)[0]
        return cls(
            states=tuple(name for name, inside in zip(names, inside_K, strict=True) if inside),
            level=guarantee.state_sets.level,
            call=str(guarantee.alarm(1 - scores_1_K[:, 0])[0]),
            missed=alarm.missed,
            false_alarms=alarm.false_alarms,
            families=guarantee.families,
        )

    def lines(self) -> list[str]:
        """Return it for a reader."""
        states = " or ".join(IN_WORDS.get(state, state) for state in self.states)
        risk = {
            GOOD: f"at most {self.missed:.0%} of the failures are called so",
            ALARM: f"at most {self.false_alarms:.0%} of the good ones are called so",
        }
        why = risk.get(self.call, "neither call keeps its promise here")
        return [
            f"set       {states} ({self.level:.0%} of such sets hold the truth)",
            f"alarm     {self.call} ({why})",
        ]


def scores_of_states(judged: Judgment) -> np.ndarray:
    """Return probabilities (N, 5) of :data:`gpca.guarantee.states.STATES` that add up to 1.

    The causes of a failure are taken for independent. That a failure has none of them is shared out in proportion to
    their probabilities, as a failure without one above the limit has its dominant cause.
    """
    causes_N_3 = np.clip(judged.causes_N_3, SMALLEST, 1)
    rest_N_3 = 1 - causes_N_3
    others_N_3 = np.stack([np.delete(rest_N_3, c, axis=1).prod(axis=1) for c in range(rest_N_3.shape[1])], axis=1)
    alone_N_3, none_N_1 = causes_N_3 * others_N_3, rest_N_3.prod(axis=1, keepdims=True)
    several_N_1 = np.maximum(1 - none_N_1 - alone_N_3.sum(axis=1, keepdims=True), 0)
    share_N_3 = causes_N_3 / causes_N_3.sum(axis=1, keepdims=True)
    of_failure_N_4 = np.hstack([alone_N_3 + none_N_1 * share_N_3, several_N_1])
    failure_N_1 = judged.failure_N[:, None]
    return np.hstack([1 - failure_N_1, failure_N_1 * of_failure_N_4])
