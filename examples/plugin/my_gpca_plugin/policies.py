"""A policy of recovery."""

from __future__ import annotations

from gpca.causes.policy import Decision
from gpca.recovery.policies import Case, Decide, Means, PolicyEntry


def take_the_last_first(means: Means) -> Decide:
    """Take the robot's actions in turn, the last one first."""

    def decide(case: Case) -> Decision:
        order = means.actions[::-1]
        return Decision(order[len(case.actions) % len(order)], "", "the last one first")

    return decide


POLICIES = {"my_last_first": PolicyEntry("Last action first (mine)", take_the_last_first)}
