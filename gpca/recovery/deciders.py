"""Deciders: what a policy does next about a registration, from what a robot has.

That is what an explainer says of the case after every action, and what was done before. None sees the truth but
:func:`follow_truth`, which is told the cause.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from gpca.pairs.perturbation import CONCEPTS
from gpca.recovery.chances import ExpectedUtility
from gpca.recovery.gate import FailureGate
from gpca.recovery.policy import NOTHING, Decision, RecoveryPolicy, Thresholds, Treated
from gpca.recovery.sequences import Order, next_of

if TYPE_CHECKING:
    from gpca.recovery.reenactment import Reenacted


@dataclass(frozen=True)
class Case:
    """The knowledge of a policy when it decides.

    Attributes:
        actions: those that were taken, in order.
        scores_T_C, bald_T: what its explainer said at the start and after each action; None where it reads none.
        observed_F: what the robot observes at the start (:data:`gpca.recovery.observation.OBSERVED`), for the gate.
        known_F: all that is known of the registration (:func:`gpca.experiments.recovery.rehearsal.known`), for
            policies that learn.
        cause: of a failure, for the oracle alone; empty for all others.
        random: the case's own numbers for policies, from their start: the same at every decision.
        reenacted: the registration as it is now, for policies that re-enact it.
    """

    actions: tuple[str, ...]
    scores_T_C: np.ndarray | None
    bald_T: np.ndarray | None
    observed_F: np.ndarray | None
    known_F: np.ndarray | None
    cause: str
    random: np.random.Generator
    reenacted: Reenacted | None = None


Decide = Callable[[Case], Decision]


@dataclass(frozen=True)
class Means:
    """The ingredients of policies.

    Attributes:
        policy: the robot's thresholds and treatments.
        actions: those it can take.
        utility, order: what the rehearsals taught: chances, and the best fixed order of actions.
        gate: it tells failures from good registrations.
        alarm: the probability of a failure, by the re-enactment, above which a registration is taken for one.
    """

    policy: RecoveryPolicy
    actions: Sequence[str]
    utility: ExpectedUtility | None = None
    order: Order = ()
    gate: FailureGate | None = None
    alarm: float | None = None


def follow_scores(means: Means) -> Decide:
    """Follow the scores of an explainer, and queue what is uncertain (:class:`gpca.recovery.policy.RecoveryPolicy`)."""
    policy = means.policy
    concept_of = {action: concept for concept, action in policy.treatments.items()}

    def decide(case: Case) -> Decision:
        scores_T_C, bald_T = case.scores_T_C, case.bald_T
        assert scores_T_C is not None and bald_T is not None  # policies that read an explainer are given both
        bald_T = np.zeros(len(scores_T_C)) if np.isnan(bald_T).any() else bald_T
        before = []
        for step, action in enumerate(case.actions):
            column = CONCEPTS.index(concept_of[action])
            fall = scores_T_C[step, column] - scores_T_C[step + 1, column]
            before.append(Treated(concept_of[action], float(fall)))
        return policy.decide(scores_T_C[-1], float(bald_T[-1]), before)

    return decide


def never_queue(means: Means) -> Decide:
    """Follow the scores, however uncertain they are, so that explainers are compared by their actions alone."""
    limits = means.policy.thresholds
    sure = Thresholds(uncertain=np.inf, dominant=0.0, improvement=limits.improvement, attempts=1_000_000)
    return follow_scores(replace(means, policy=replace(means.policy, thresholds=sure)))


def weigh_chances(means: Means) -> Decide:
    """Take what is worth most by its learned chance and its cost (:class:`gpca.recovery.chances.ExpectedUtility`)."""
    return _weigh(means, alarmed=False)


def weigh_alarmed(means: Means) -> Decide:
    """Do the same as if told that the pose is wrong, so that actions are compared apart from recognizing failures."""
    return _weigh(means, alarmed=True)


def _weigh(means: Means, alarmed: bool) -> Decide:
    utility = means.utility
    assert utility is not None  # policies that learn are given rehearsals

    def decide(case: Case) -> Decision:
        assert case.known_F is not None
        return utility.decide(case.known_F, case.actions, alarmed)

    return decide


def act_at_random(means: Means) -> Decide:
    """Take any action at random; the same one may come again."""

    def decide(case: Case) -> Decision:
        # The case's numbers start anew at every decision, so the draws before are drawn again.
        drawn = case.random.integers(len(means.actions), size=len(case.actions) + 1)[-1]
        return Decision(means.actions[int(drawn)], "", "at random")

    return decide


def act_in_turn(means: Means) -> Decide:
    """Take all actions in turn, in an order drawn for each case."""

    def decide(case: Case) -> Decision:
        order = case.random.permutation(len(means.actions))
        return Decision(means.actions[order[len(case.actions) % len(means.actions)]], "", "in turn")

    return decide


def follow_rehearsed(means: Means) -> Decide:
    """Take the actions in the order that was best on the rehearsals, whatever the cause."""
    return follow_sequence(means.order)(means)


def follow_reenactment(means: Means) -> Decide:
    """Treat the cause without which the registration would gain most, by its re-enactment as it is now.

    An action that was taken without success comes again only after all others.
    """
    treatments = means.policy.treatments

    def decide(case: Case) -> Decision:
        assert case.reenacted is not None  # policies that re-enact are given it
        gains = dict(zip(CONCEPTS, case.reenacted.phi_3.tolist(), strict=True))
        fewest = min(case.actions.count(action) for action in treatments.values())
        untried = [concept for concept in gains if case.actions.count(treatments[concept]) == fewest]
        best = max(untried, key=gains.__getitem__)
        return Decision(treatments[best], best, f"{best} adds {gains[best]:.3f} of the diameter to the error")

    return decide


def gated(make: Callable[[Means], Decide]) -> Callable[[Means], Decide]:
    """Return a maker of the policy that leaves alone what the gate takes for good."""

    def make_gated(means: Means) -> Decide:
        gate = means.gate
        assert gate is not None  # policies that ask a gate are given one

        def alarms(case: Case) -> bool:
            assert case.observed_F is not None
            return gate.alarms(case.observed_F)

        return _unless_good(make(means), alarms)

    return make_gated


def gated_by_reenactment(make: Callable[[Means], Decide]) -> Callable[[Means], Decide]:
    """Return a maker of the policy that leaves alone what the re-enactment takes for good."""

    def make_gated(means: Means) -> Decide:
        threshold = means.alarm
        assert threshold is not None  # policies that ask for the alarm are given its threshold

        def alarms(case: Case) -> bool:
            assert case.reenacted is not None
            return case.reenacted.belief.failure > threshold

        return _unless_good(make(means), alarms)

    return make_gated


def _unless_good(decide: Decide, alarms: Callable[[Case], bool]) -> Decide:
    """Decide where there is an alarm at the start; who has acted is told that the pose is wrong yet."""

    def decide_gated(case: Case) -> Decision:
        if case.actions or alarms(case):
            return decide(case)
        return Decision(NOTHING, "", "it is taken for good")

    return decide_gated


def follow_truth(means: Means) -> Decide:
    """Take the action that treats the true cause, again and again; without a cause, none."""
    treatments = means.policy.treatments
    return lambda case: Decision(treatments.get(case.cause, NOTHING), case.cause, "told the cause")


def always_act(action: str) -> Callable[[Means], Decide]:
    """Return a maker of the policy that always takes this action."""
    return lambda means: lambda case: Decision(action, "", "always")


def follow_sequence(order: Order) -> Callable[[Means], Decide]:
    """Return a maker of the policy that takes these actions one after the other."""
    return lambda means: lambda case: Decision(next_of(order, case.actions), "", "next of a fixed sequence")
