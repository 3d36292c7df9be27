"""A policy of recovery."""

from __future__ import annotations

from gpca.causes.policy import Decision
from gpca.recovery.policies import Case, Means, PolicyEntry


def take_the_last_first(case: Case, means: Means) -> Decision:
    """Take the robot's actions in turn, the last one first."""
    order = means.actions[::-1]
    return Decision(order[len(case.actions) % len(order)], "", "the last one first")


POLICIES = {"my_last_first": PolicyEntry("Last action first (mine)", take_the_last_first)}
