"""Recovery policies by name: functions that choose the next action; only ``oracle`` is given the cause."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import permutations
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.causes.policy import NOTHING, Decision, RecoveryPolicy, Thresholds, Treated
from gpca.errors import require_known
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.registry import Registry
from gpca.recovery.chances import ExpectedUtility, FailureGate

if TYPE_CHECKING:
    from gpca.recovery.reenactment import CauseEffects

Order = tuple[str, ...]  # a sequence of actions
SEQUENCE = "sequence"  # prefix of the names of fixed sequences, such as sequence_reinitialize_new_view
ALWAYS = "always_"  # prefix of the names of policies that always take one action
ERROR_ONLY = {True: "error_only_acting", False: "error_only"}  # by whether it is given that the pose is wrong


@dataclass(frozen=True)
class Case:
    """The inputs of a decision."""

    actions: tuple[str, ...]  # taken so far
    scores_T_C: Any  # of the explainer at the start and after each action; this and the next are None without one
    bald_T: Any
    observed_F: Any  # at the start (:data:`gpca.recovery.actions.OBSERVED`), for the gate; else None
    known_F: Any  # all features (:func:`gpca.recovery.loop.policy_inputs`), for trained policies; else None
    cause: str  # of the failure, for the oracle only; otherwise empty
    random: np.random.Generator  # of the case, restarted for every decision
    reenacted: CauseEffects | None = None  # the current registration, for policies that read it


@dataclass(frozen=True)
class Means:
    """The ingredients of policies."""

    policy: RecoveryPolicy  # thresholds and treatments of the robot
    actions: Sequence[str]  # that are available
    utility: ExpectedUtility | None = None  # learned on the rehearsals, as is
    order: Order = ()  # the best fixed order of actions
    gate: FailureGate | None = None  # separates failures from good registrations
    # Probability of a failure by the re-enactment above which a registration counts as failed.
    alarm: float | None = None


Decide = Callable[[Case, Means], Decision]


def follow_scores(case: Case, means: Means) -> Decision:
    """Follow an explainer's scores and queue uncertain cases (:class:`gpca.causes.policy.RecoveryPolicy`)."""
    scores_T_C, bald_T = case.scores_T_C, case.bald_T
    concept_of = {action: concept for concept, action in means.policy.treatments.items()}
    bald_T = np.zeros(len(scores_T_C)) if np.isnan(bald_T).any() else bald_T
    before = []
    for step, action in enumerate(case.actions):
        column = CONCEPTS.index(concept_of[action])
        before.append(Treated(concept_of[action], float(scores_T_C[step, column] - scores_T_C[step + 1, column])))
    return means.policy.decide(scores_T_C[-1], float(bald_T[-1]), before)


def never_queue(case: Case, means: Means) -> Decision:
    """Follow the scores without queueing, so that explainers are compared by their actions alone."""
    limits = means.policy.thresholds
    sure = Thresholds(uncertain=np.inf, dominant=0.0, improvement=limits.improvement, attempts=1_000_000)
    return follow_scores(case, replace(means, policy=replace(means.policy, thresholds=sure)))


def weigh_chances(case: Case, means: Means, alarmed: bool = False) -> Decision:
    """Maximize the expected utility (:class:`gpca.recovery.chances.ExpectedUtility`), if alarmed of a wrong pose."""
    assert means.utility is not None
    return means.utility.decide(case.known_F, case.actions, alarmed)


def act_at_random(case: Case, means: Means) -> Decision:
    # The random numbers restart at every decision, so earlier draws are repeated.
    drawn = case.random.integers(len(means.actions), size=len(case.actions) + 1)[-1]
    return Decision(means.actions[drawn], "", "at random")


def follow_reenactment(case: Case, means: Means) -> Decision:
    """Treat the cause with the largest effect in the re-enactment; each action repeats only after all others."""
    assert case.reenacted is not None
    treatments = means.policy.treatments
    gains = dict(zip(CONCEPTS, case.reenacted.phi_3.tolist(), strict=True))
    fewest = min(case.actions.count(action) for action in treatments.values())
    untried = [concept for concept in gains if case.actions.count(treatments[concept]) == fewest]
    best = max(untried, key=gains.__getitem__)
    return Decision(treatments[best], best, f"{best} adds {gains[best]:.3f} of the diameter to the error")


def gated(decide: Decide) -> Decide:
    """Let a policy act only if the gate, or the re-enactment that it reads, raises an alarm at the start."""

    def alarms(case: Case, means: Means) -> bool:
        if case.reenacted is not None and means.alarm is not None:
            return case.reenacted.belief.failure > means.alarm
        assert means.gate is not None
        return means.gate.alarms(case.observed_F)

    good = Decision(NOTHING, "", "it is taken for good")
    return lambda case, means: decide(case, means) if case.actions or alarms(case, means) else good


def follow_truth(case: Case, means: Means) -> Decision:
    """Repeat the action that treats the true cause; do nothing without a cause."""
    return Decision(means.policy.treatments.get(case.cause, NOTHING), case.cause, "told the cause")


def repairing(decide: Decide) -> Decide:
    """Let a policy choose only after the pose was searched anew, for which nothing in the world has to move."""

    def repair_first(case: Case, means: Means) -> Decision:
        first = Decision(means.policy.treatments["pose"], "", "repair before anything moves")
        return decide(case, means) if case.actions else first

    return repair_first


def follow_sequence(case: Case, means: Means, order: Order = (), reason: str = "next of a fixed sequence") -> Decision:
    """Take the actions of a sequence in turn, whatever is observed; by default the best order on the rehearsals."""
    taken = order or means.order
    return Decision(taken[len(case.actions) % len(taken)], "", reason)


def best_order(
    actions: Sequence[str], costs: Mapping[str, float], solved: Sequence[Callable[[Order], bool]], budget: int
) -> Order:
    """Return the greedy order of actions: each solves most of the remaining failures; ties go to the cheaper one."""
    order: Order = ()
    left, remaining = list(solved), list(actions)
    while remaining:
        counts = dict.fromkeys(remaining, 0)
        if len(remaining) > 1 and len(order) < budget:
            counts = {action: sum(solves((*order, action)) for solves in left) for action in remaining}
        best = max(remaining, key=lambda action: (counts[action], -costs[action]))
        order = (*order, best)
        remaining.remove(best)
        if len(remaining) > 1 and len(order) < budget:
            left = [solves for solves in left if not solves(order)]
    return order


@dataclass(frozen=True)
class PolicyEntry:
    """A registered policy."""

    title: str  # in tables
    decide: Decide
    explainer: str = ""  # its name (:mod:`gpca.explainers.registry`), or empty
    queues: bool = False  # leaves cases to a person, whose labels its explainer can learn
    learns: bool = False  # uses the chances learned on the rehearsals
    rehearsed: bool = False  # uses the best order on the rehearsals
    gated: bool = False  # asks the gate first
    reenacts: bool = False  # reads the re-enactment of the registration
    alarmed: bool = False  # asks the re-enactment for an alarm first
    informed: bool = True  # it is given that the pose is wrong, so it would act on every good registration too
    oracle: bool = False  # is given the cause


weigh_alarmed = partial(weigh_chances, alarmed=True)  # compares actions apart from detecting failures
_LEARNED: dict[str, Any] = {"explainer": "gpca", "learns": True}
_GATED: dict[str, Any] = {"gated": True, "informed": False}
_BY_REENACTMENT: dict[str, Any] = {"reenacts": True, "alarmed": True, "informed": False}
POLICIES = {
    "gpca": PolicyEntry("GP-CA", follow_scores, explainer="gpca", queues=True, informed=False),
    "gpca_acting": PolicyEntry("GP-CA, never queued", never_queue, explainer="gpca"),
    "gpca_gated": PolicyEntry("GP-CA, gated", gated(never_queue), explainer="gpca", **_GATED),
    "utility": PolicyEntry("Expected utility, learned", weigh_chances, **_LEARNED, informed=False),
    "utility_acting": PolicyEntry("Expected utility, alarmed", weigh_alarmed, **_LEARNED),
    "utility_gated": PolicyEntry("Expected utility, gated", gated(weigh_alarmed), **_LEARNED, **_GATED),
    "error_only": PolicyEntry("Error only, gated", gated(follow_sequence), rehearsed=True, **_GATED),
    "error_only_acting": PolicyEntry("Error only, alarmed", follow_sequence, rehearsed=True),
    "reenact": PolicyEntry("Re-enactment", follow_reenactment, reenacts=True),
    "reenact_gated": PolicyEntry("Re-enactment, gated", gated(follow_reenactment), **_BY_REENACTMENT),
    "error_only_reenact": PolicyEntry(
        "Error only, re-enactment's gate", gated(follow_sequence), rehearsed=True, **_BY_REENACTMENT
    ),
    "shap_removal": PolicyEntry("SHAP, remedies, residual", never_queue, explainer="shap_removal_residual"),
    "softmax_head": PolicyEntry("Softmax head", never_queue, explainer="softmax_head"),
    "random": PolicyEntry("Random action", act_at_random),
    "oracle": PolicyEntry("Oracle cause", follow_truth, oracle=True),
    "repair_gpca": PolicyEntry("Repair, then GP-CA, never queued", repairing(never_queue), explainer="gpca"),
    "repair_oracle": PolicyEntry("Repair, then oracle cause", repairing(follow_truth), oracle=True),
}


REGISTRY: Registry[PolicyEntry] = Registry("recovery policy", "", "POLICIES", first=(__name__,), outside=PolicyEntry)
named_policies, policy_module = REGISTRY.entries, REGISTRY.module


def is_fixed(name: str, actions: Sequence[str]) -> bool:
    return name in policies(actions) and name not in named_policies()


def policies(actions: Sequence[str]) -> dict[str, PolicyEntry]:
    """Return all policies by name, including those that always take one action, or at least two of them in turn."""
    entries = named_policies()
    words = {action: action.replace("_", " ") for action in actions}
    for action in actions:
        entries[ALWAYS + action] = PolicyEntry(
            f"Always: {words[action]}", partial(follow_sequence, order=(action,), reason="always")
        )
    for length in range(2, len(actions) + 1):
        for order in permutations(actions, length):
            title = ", then ".join(words[action] for action in order).capitalize()
            entries["_".join((SEQUENCE, *order))] = PolicyEntry(title, partial(follow_sequence, order=order))
    return entries


def policy_entry(name: str, actions: Sequence[str]) -> PolicyEntry:
    entries = policies(actions)
    require_known("recovery policy", name, entries)
    return entries[name]
