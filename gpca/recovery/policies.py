"""Policies of recovery by name: how they decide about a failed registration, and what they need for it.

A policy is told that the pose is wrong unless it finds that out itself or asks the gate. ``oracle``, which is told the
cause, is there as a bound.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from gpca.errors import require_known
from gpca.plugins import joined_outside, module_outside
from gpca.recovery.deciders import (
    Decide,
    Means,
    act_at_random,
    act_in_turn,
    always_act,
    follow_reenactment,
    follow_rehearsed,
    follow_scores,
    follow_sequence,
    follow_truth,
    gated,
    gated_by_reenactment,
    never_queue,
    weigh_alarmed,
    weigh_chances,
)
from gpca.recovery.sequences import sequences, title_of_sequence


@dataclass(frozen=True)
class PolicyEntry:
    """A policy by name.

    Attributes:
        title: what tables call it.
        make: function that makes it.
        explainer: the one that it reads (:mod:`gpca.explainers.registry`), empty for none.
        queues: whether it leaves cases to a person, whose labels its explainer can learn.
        learns: whether it weighs chances that the rehearsals taught.
        rehearsed: whether it takes the best order of the rehearsals.
        gated: whether it asks the gate first.
        reenacts: whether it reads the re-enactment of the registration.
        alarmed: whether it asks the re-enactment for an alarm first.
        told: whether it is told that the pose is wrong, so that it would act on every good registration too.
        oracle: whether it is told the cause.
    """

    title: str
    make: Callable[[Means], Decide]
    explainer: str = ""
    queues: bool = False
    learns: bool = False
    rehearsed: bool = False
    gated: bool = False
    reenacts: bool = False
    alarmed: bool = False
    told: bool = True
    oracle: bool = False


ALWAYS = "always_"  # with an action's name behind it, the policy that always takes this action
ERROR_ONLY = {True: "error_only_acting", False: "error_only"}  # whether it is told that the pose is wrong -> policy
POLICIES = {
    "gpca": PolicyEntry("GP-CA", follow_scores, explainer="gpca", queues=True, told=False),
    "gpca_acting": PolicyEntry("GP-CA, never queued", never_queue, explainer="gpca"),
    "gpca_gated": PolicyEntry("GP-CA, gated", gated(never_queue), explainer="gpca", gated=True, told=False),
    "utility": PolicyEntry("Expected utility, learned", weigh_chances, explainer="gpca", learns=True, told=False),
    "utility_acting": PolicyEntry("Expected utility, alarmed", weigh_alarmed, explainer="gpca", learns=True),
    "utility_gated": PolicyEntry(
        "Expected utility, gated", gated(weigh_alarmed), explainer="gpca", learns=True, gated=True, told=False
    ),
    "error_only": PolicyEntry("Error only, gated", gated(follow_rehearsed), rehearsed=True, gated=True, told=False),
    "error_only_acting": PolicyEntry("Error only, alarmed", follow_rehearsed, rehearsed=True),
    "reenact": PolicyEntry("Re-enactment", follow_reenactment, reenacts=True),
    "reenact_gated": PolicyEntry(
        "Re-enactment, gated", gated_by_reenactment(follow_reenactment), reenacts=True, alarmed=True, told=False
    ),
    "error_only_reenact": PolicyEntry(
        "Error only, re-enactment's gate",
        gated_by_reenactment(follow_rehearsed),
        rehearsed=True,
        reenacts=True,
        alarmed=True,
        told=False,
    ),
    "shap_removal": PolicyEntry("SHAP, remedies, residual", never_queue, explainer="shap_removal_residual"),
    "softmax_head": PolicyEntry("Softmax head", never_queue, explainer="softmax_head"),
    "random": PolicyEntry("Random action", act_at_random),
    "round_robin": PolicyEntry("Round robin", act_in_turn),
    "oracle": PolicyEntry("Oracle cause", follow_truth, oracle=True),
}


def named_policies() -> dict[str, PolicyEntry]:
    """Return the policies that have a name of their own, those from outside included."""
    return joined_outside("POLICIES", "recovery policy", PolicyEntry, POLICIES)


def policy_module(name: str) -> str | None:
    """Return the module from outside that lists the policy; None of one of the suite's own."""
    return module_outside("POLICIES", "recovery policy", PolicyEntry, name)


def is_fixed(name: str, actions: Sequence[str]) -> bool:
    """Return whether the policy takes the same actions in the same order whatever it is told and observes."""
    return name in policies(actions) and name not in named_policies()


def policies(actions: Sequence[str]) -> dict[str, PolicyEntry]:
    """Return all policies by name, those that always take one of these actions or a sequence of them included."""
    always = {ALWAYS + a: PolicyEntry(f"Always: {a.replace('_', ' ')}", always_act(a)) for a in actions}
    fixed = {
        name: PolicyEntry(title_of_sequence(order), follow_sequence(order))
        for name, order in sequences(actions).items()
    }
    return named_policies() | always | fixed


def policy_entry(name: str, actions: Sequence[str]) -> PolicyEntry:
    """Return the policy of that name.

    Raises:
        InputError: unknown policy, or one that takes an unknown action.
    """
    known = policies(actions)
    require_known("recovery policy", name, known)
    return known[name]
