"""Sets of states: how ill a state fits, and how often sets hold the true one in simulations."""

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.guarantee.conformal import CUMULATIVE, PROBABILITY, calibrate_sets, nonconformity

STATES = ("good", "poor", "lost")


def drawn(random, samples, mix=(0.6, 0.3, 0.1)):
    """Scores and states of samples: the third state is the hardest to see."""
    number_N = random.choice(3, samples, p=mix)
    logits = 1.5 * np.eye(3)[number_N] * np.array([1, 1, 0.3])[number_N, None] + random.normal(size=(samples, 3))
    scores = np.exp(logits)
    return scores / scores.sum(axis=1, keepdims=True), np.array(STATES)[number_N]


def held(sets, scores, state):
    return sets.of(scores)[np.arange(len(state)), [STATES.index(name) for name in state]]


def test_nonconformity_by_hand():
    scores = np.array([[0.5, 0.3, 0.2], [0.4, 0.4, 0.2]])
    assert nonconformity(scores, PROBABILITY) == pytest.approx(1 - scores)
    assert nonconformity(scores, CUMULATIVE) == pytest.approx(np.array([[0.5, 0.8, 1.0], [0.8, 0.8, 1.0]]))
    with pytest.raises(InputError, match="nonconformity 'rank': unknown; choose probability or cumulative"):
        nonconformity(scores, "rank")


@pytest.mark.parametrize("kind", [PROBABILITY, CUMULATIVE])
def test_sets_hold_the_true_state_as_often_as_promised(kind):
    random = np.random.default_rng(0)
    shares = []
    for _ in range(300):
        scores, state = drawn(random, 200)
        sets = calibrate_sets(scores[:100], state[:100], None, STATES, 0.9, kind)
        shares.append(held(sets, scores[100:], state[100:]).mean())
    deviation = np.std(shares) / np.sqrt(300)
    assert 0.9 - 4 * deviation <= np.mean(shares) <= 0.9 + 1 / 101 + 0.03  # what is never empty covers a little more


def test_only_sets_by_state_hold_each_state_as_often_as_promised():
    random = np.random.default_rng(1)
    scores, state = drawn(random, 20000)
    tested, tested_state = drawn(random, 20000)
    share = {}
    for by_state in (False, True):
        sets = calibrate_sets(scores, state, None, STATES, 0.9, by_state=by_state)
        inside = held(sets, tested, tested_state)
        share[by_state] = [inside[tested_state == name].mean() for name in STATES]
    assert min(share[False]) < 0.8
    assert min(share[True]) > 0.885
    assert set(np.isfinite(sets.limits)) == {True}


def test_the_hardest_state_is_in_every_set_where_too_few_were_given():
    scores, state = drawn(np.random.default_rng(2), 60)
    few = np.flatnonzero(state == "lost")[8:]
    kept = np.setdiff1d(np.arange(60), few)
    sets = calibrate_sets(scores[kept], state[kept], None, STATES, 0.9, by_state=True)
    assert sets.limits[2] == np.inf and sets.of(scores)[:, 2].all()


def test_no_set_is_empty():
    scores = np.array([[0.9, 0.05, 0.05]] * 30)
    sets = calibrate_sets(scores, np.array(["good"] * 30), None, STATES, 0.9)
    assert sets.of(np.array([[0.3, 0.4, 0.3], [0.9, 0.05, 0.05]])).tolist() == [
        [False, True, False],
        [True, False, False],
    ]


@pytest.mark.parametrize(
    ("scores", "state", "level", "message"),
    [
        (np.ones((2, 4)), ["good", "good"], 0.9, r"scores: have the shape \(2, 4\) or are not finite; give a finite"),
        (np.full((2, 3), np.nan), ["good", "good"], 0.9, "scores: have the shape .* or are not finite"),
        (np.ones((2, 3)), ["good", "odd"], 0.9, "state 'odd': unknown; choose one of good, poor, lost"),
        (np.ones((2, 3)), ["good", "good"], 90, "level of the sets: 90 is not strictly between 0 and 1"),
    ],
)
def test_faults_are_one_line(scores, state, level, message):
    with pytest.raises(InputError, match=message):
        calibrate_sets(scores, np.array(state), None, STATES, level)
