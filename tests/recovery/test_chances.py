"""Probabilities learned on the training tables."""

import numpy as np
import pytest

from gpca.causes.policy import NOTHING
from gpca.errors import InputError
from gpca.recovery.chances import Chances, ExpectedUtility, Trial, alarm_threshold, learn_gate

COSTS = {"denoise": 0.02, "new_view": 0.03}


@pytest.fixture
def chances(monkeypatch):
    """The first number tells whether the pose is right, the second which action helps."""
    random = np.random.default_rng(0)
    trials = []
    for _ in range(60):
        known_F = random.choice([-1.0, 1.0], 2)
        trials.append(Trial(known_F, NOTHING, known_F[0] > 0))
        trials += [Trial(known_F, "denoise", known_F[1] > 0), Trial(known_F, "new_view", known_F[1] < 0)]
    monkeypatch.setattr("gpca.recovery.chances.INVERSE_REGULARIZATION", 1.0)
    return Chances(trials, tuple(COSTS))


def test_chances_follow_what_is_known_and_what_always_helped_has_the_rate_of_succession(chances):
    assert chances.of("denoise", np.array([0.0, 1.0])) > 0.8 > 0.2 > chances.of("denoise", np.array([0.0, -1.0]))
    assert chances.of(NOTHING, np.array([1.0, 0.0])) > 0.8
    few = Chances([Trial(np.zeros(2), "denoise", True)] * 4, tuple(COSTS))
    assert few.of("denoise", np.zeros(2)) == pytest.approx(5 / 6)
    assert few.of("new_view", np.zeros(2)) == 0.5  # never tried


@pytest.mark.parametrize(
    ("known_F", "before", "action"),
    [
        ((-1, 1), (), "denoise"),
        ((-1, -1), (), "new_view"),
        ((-1, 1), ("denoise",), "new_view"),  # not again before the other
        ((-1, 1), ("denoise", "new_view"), "denoise"),
        ((9, 1), (), NOTHING),
    ],
)
def test_the_action_of_the_largest_gain_is_taken_and_none_where_nothing_is_wrong(chances, known_F, before, action):
    decision = ExpectedUtility(chances, COSTS).decide(np.array(known_F, float), before)
    assert decision.action == action


def test_what_may_be_right_is_left_alone_where_needless_acts_are_dear(chances):
    unsure = np.array([0.3, 1.0])
    assert 0.5 < chances.of(NOTHING, unsure) < 0.9
    assert ExpectedUtility(chances, COSTS).decide(unsure, ()).action == "denoise"
    careful = ExpectedUtility(chances, COSTS, needless=1.0)
    assert careful.decide(unsure, ()).action == NOTHING
    assert careful.decide(unsure, ("denoise",)).action == "new_view"  # its pose is known to be wrong
    assert careful.decide(unsure, (), alarmed=True).action == "denoise"


def registrations(count, random):
    """Half of them failed, which a number shows; twenty tables."""
    failed_N = np.arange(count) % 2 == 0
    observed_N_F = random.normal(size=(count, 3)) + 2.0 * failed_N[:, None]
    return observed_N_F, failed_N, np.arange(count) % 20


def test_most_failures_are_found_and_few_good_ones_acted_on():
    random = np.random.default_rng(0)
    gate = learn_gate(*registrations(400, random), 0.05)
    observed_N_F, failed_N, _ = registrations(2000, random)
    alarms_N = np.array([gate.alarms(observed_F) for observed_F in observed_N_F])
    assert alarms_N[failed_N].mean() > 0.8
    assert 0.01 < alarms_N[~failed_N].mean() < 0.09


def test_the_threshold_is_set_on_good_ones_of_other_tables_by_the_rank_of_conformal_prediction():
    # Each table has a place of its own: a classifier that has learned it would know its registrations.
    random = np.random.default_rng(1)
    table_N = np.repeat(np.arange(10), 4)
    failed_N = np.tile([True, False, False, False], 10)
    observed_N_F = random.normal(size=(40, 40))  # as many numbers as registrations: all can be told apart by heart
    gate = learn_gate(observed_N_F, failed_N, table_N, 0.2)
    by_heart = np.sort(gate.failure(observed_N_F[~failed_N]))
    assert gate.threshold > by_heart[-6]
    values = np.arange(1, 20) / 20
    assert alarm_threshold(values, 0.05) == values[-1]  # the 19th of 19
    assert alarm_threshold(values, 0.1) == values[-2]
    assert alarm_threshold(values[:5], 0.05) == values[4]


@pytest.mark.parametrize(
    ("failed", "kind"), [([True] * 6, "good"), ([False] * 6, "failed"), ([True, True] + [False] * 4, "failed")]
)
def test_a_gate_needs_failures_and_good_ones_on_two_tables(failed, kind):
    with pytest.raises(InputError, match=f"{kind} training registrations stand on . of the two tables"):
        learn_gate(np.zeros((6, 2)), np.array(failed), [0, 0, 1, 1, 2, 2], 0.05)
