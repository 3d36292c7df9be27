"""Policies: what they need, and the actions that they choose."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from gpca.causes.policy import NOTHING, QUEUE, RecoveryPolicy, Thresholds
from gpca.errors import InputError
from gpca.recovery.chances import Chances, ExpectedUtility, Trial
from gpca.recovery.policies import Case, Means, best_order, is_fixed, policies, policy_entry
from gpca.seeds import generator

ACTIONS = ("reinitialize", "new_view", "denoise")
POLICY = RecoveryPolicy(Thresholds(uncertain=0.2, dominant=0.4))


def case(actions=(), scores=None, bald=None, observed=None, known=None, cause="", episode=0, reenacted=None):
    scores = None if scores is None else np.array(scores, float)
    bald = None if bald is None else np.array(bald, float)
    return Case(actions, scores, bald, observed, known, cause, generator("test", episode), reenacted)


def made(name, **means):
    return partial(policy_entry(name, ACTIONS).decide, means=Means(POLICY, ACTIONS, **means))


def test_gpca_follows_the_scores_and_what_an_action_changed_and_queues_what_is_uncertain():
    sure, unsure = case(scores=[[0.1, 0.2, 0.7]], bald=[0.1]), case(scores=[[0.1, 0.2, 0.7]], bald=[0.3])
    assert made("gpca")(sure).action == made("gpca_acting")(sure).action == "new_view"
    assert made("gpca")(unsure).action == QUEUE
    assert made("gpca_acting")(unsure).action == "new_view"
    for first, action in (([0.1, 0.2, 0.7], "reinitialize"), ([0.1, 0.0, 0.9], "new_view")):  # stuck, fallen
        taken = case(actions=("new_view",), scores=[first, [0.1, 0.25, 0.65]], bald=[0.1, 0.1])
        assert made("gpca")(taken).action == action
    assert made("softmax_head")(case(scores=[[0.8, 0.1, 0.1]], bald=[np.nan])).action == "denoise"


def test_the_learned_policy_decides_by_what_is_known_and_done_and_leaves_alone_what_seems_right_unless_alarmed():
    trials = [Trial(np.zeros(1), action, action == "new_view") for action in ACTIONS for _ in range(8)]
    utility = ExpectedUtility(Chances(trials, ACTIONS), dict.fromkeys(ACTIONS, 0.01))
    assert made("utility", utility=utility)(case(known=np.zeros(1))).action == "new_view"
    assert made("utility", utility=utility)(case(("new_view",), known=np.zeros(1))).action != "new_view"
    trials = [Trial(np.zeros(1), NOTHING, True)] * 30 + [Trial(np.zeros(1), "denoise", True)] * 8
    utility = ExpectedUtility(Chances(trials, ACTIONS), dict.fromkeys(ACTIONS, 0.05))
    assert made("utility", utility=utility)(case(known=np.zeros(1))).action == NOTHING
    assert made("utility_acting", utility=utility)(case(known=np.zeros(1))).action == "denoise"


class Gate:
    """Takes for failed what has a positive number."""

    def alarms(self, observed_F):
        return observed_F[0] > 0


@pytest.mark.parametrize("name", ["gpca_gated", "utility_gated", "error_only"])
def test_gated_policies_leave_alone_what_the_gate_takes_for_good_and_act_on_the_rest(name):
    trials = [Trial(np.zeros(1), action, action == "new_view") for action in ACTIONS for _ in range(8)]
    utility = ExpectedUtility(Chances(trials, ACTIONS), dict.fromkeys(ACTIONS, 0.01))
    decide = made(name, utility=utility, gate=Gate(), order=("new_view", "denoise", "reinitialize"))
    seen = {"scores": [[0.1, 0.2, 0.7]], "bald": [0.9], "known": np.zeros(1)}
    assert decide(case(observed=np.array([-1.0]), **seen)).action == NOTHING
    assert decide(case(observed=np.array([1.0]), **seen)).action == "new_view"
    again = seen | {"scores": seen["scores"] * 2, "bald": [0.9, 0.9]}
    assert decide(case(("new_view",), observed=np.array([-1.0]), **again)).action != NOTHING  # it is known to be wrong


def reenacted(phi, failure=1.0):
    return SimpleNamespace(phi_3=np.array(phi), belief=SimpleNamespace(failure=failure))


def test_the_re_enactment_is_followed_to_the_cause_that_adds_most_and_repeats_no_action_before_all_were_taken():
    phi = [0.3, 0.1, 0.2]
    taken = ()
    for _ in range(4):
        taken += (made("reenact")(case(taken, reenacted=reenacted(phi))).action,)
    assert taken == ("denoise", "new_view", "reinitialize", "denoise")
    now = case(("denoise",), reenacted=reenacted([0.3, 0.2, 0.1]))  # what it is after the action counts
    assert made("reenact")(now).action == "reinitialize"
    assert made("reenact")(now).concept == "pose"


@pytest.mark.parametrize(("name", "action"), [("reenact_gated", "denoise"), ("error_only_reenact", "new_view")])
def test_the_alarm_of_the_re_enactment_has_a_threshold(name, action):
    decide = made(name, alarm=0.4, order=("new_view", "denoise", "reinitialize"))
    quiet, loud = (reenacted([0.3, 0.1, 0.2], failure) for failure in (0.4, 0.5))
    assert decide(case(reenacted=quiet)).action == NOTHING
    assert decide(case(reenacted=loud)).action == action
    assert decide(case((action,), reenacted=quiet)).action not in (NOTHING, action)  # it is known to be wrong


def test_a_sequence_takes_its_actions_in_turn_and_begins_anew():
    decide = made("sequence_new_view_denoise")
    taken = ()
    for _ in range(3):
        taken += (decide(case(taken)).action,)
    assert taken == ("new_view", "denoise", "new_view")
    decide = made("error_only_acting", order=("new_view", "denoise", "reinitialize"))  # the rehearsed one
    assert [decide(case(taken)).action for taken in ((), ("new_view",))] == ["new_view", "denoise"]
    fixed = {"sequence_new_view_denoise", "always_denoise"}
    assert {name for name in (*fixed, "random", "gpca") if is_fixed(name, ACTIONS)} == fixed


def test_who_is_told_that_the_pose_is_wrong():
    alone = {name for name, entry in policies(ACTIONS).items() if not entry.informed}
    gated = {"gpca_gated", "utility_gated", "error_only", "reenact_gated", "error_only_reenact"}
    assert alone == {"gpca", "utility", *gated}


def test_a_repair_comes_first_fixed_actions_stay_and_the_oracle_is_told_the_cause():
    assert made("repair_oracle")(case(cause="overlap")).action == "reinitialize"
    assert made("repair_oracle")(case(("reinitialize",), cause="overlap")).action == "new_view"
    scores = [[0.8, 0.1, 0.1], [0.7, 0.2, 0.1]]
    assert made("repair_gpca")(case(("reinitialize",), scores, bald=[0.9, 0.9])).action == "denoise"
    assert made("always_denoise")(case()).action == "denoise"
    treated = [made("oracle")(case(cause=cause)).action for cause in ("noise", "pose", "overlap")]
    assert treated == ["denoise", "reinitialize", "new_view"]
    assert made("oracle")(case()).action == NOTHING  # it is told that nothing is wrong
    assert policy_entry("oracle", ACTIONS).oracle
    assert not any(policy_entry(name, ACTIONS).oracle for name in ("gpca", "random", "always_denoise"))


@pytest.mark.parametrize(
    "name", ["gpac", "always_pray", "always_", "denoise", "sequence_denoise", "sequence_denoise_denoise"]
)
def test_an_unknown_policy_is_refused_and_the_known_are_named(name):
    with pytest.raises(InputError, match=rf"recovery policy '{name}': unknown; choose one of gpca, .*always_denoise"):
        policy_entry(name, ACTIONS)


COSTS = {"a": 0.01, "b": 0.03, "c": 0.02}


def helped_by(*actions):
    asked = []

    def solved(taken):
        asked.append(taken)
        return taken[-1] in actions

    solved.asked = asked
    return solved


def test_the_order_that_recovers_failures_soonest_is_chosen():
    failures = [helped_by("c"), helped_by("c"), helped_by("b")]
    assert best_order(("a", "b", "c"), COSTS, failures, 3) == ("c", "b", "a")
    assert all(len(taken) <= 3 for taken in failures[0].asked)
    assert ("c", "b") not in failures[0].asked  # nothing is tried after success
    assert ("c", "b", "a") not in failures[2].asked  # nothing is left to compare
    # Of orders that are as soon, the cheapest is chosen.
    assert best_order(("b", "a", "c"), COSTS, [helped_by("a", "b", "c")], 3)[0] == "a"
    assert best_order(("b", "a", "c"), COSTS, [helped_by()], 2) == ("a", "c", "b")
