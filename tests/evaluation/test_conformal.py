"""Conformal bounds, sets of states and alarms: by hand, and in simulations."""

from math import ceil, inf

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.evaluation import conformal
from gpca.evaluation.conformal import ALARM, GOOD, NOT_SURE, upper_bound

DRAWS = 4000


@pytest.mark.parametrize(("samples", "level"), [(9, 0.9), (19, 0.9), (20, 0.9), (99, 0.95), (100, 0.95), (57, 0.8)])
def test_the_bound_is_the_value_of_the_rank_that_split_conformal_prediction_names(samples, level):
    values = np.random.default_rng(0).permutation(samples).astype(float)
    rank = ceil(round((samples + 1) * level, 9))
    assert upper_bound(values, level) == upper_bound(values, level, np.arange(samples)) == rank - 1  # families of one
    # NumPy's quantile of type 1, at the level that is corrected for the finite sample, as MAPIE takes it
    corrected = min(1.0, (samples + 1) * level / samples)
    assert upper_bound(values, level) == np.quantile(values, corrected - 1e-12, method="inverted_cdf")


def test_the_bound_holds_exactly_as_often_as_promised_and_too_few_samples_bound_nothing():
    assert upper_bound(np.arange(8.0), 0.9) == inf and upper_bound(np.arange(9.0), 0.9) == 8
    families = np.repeat(np.arange(8), 50)
    assert upper_bound(np.arange(400.0), 0.9, families) == inf and upper_bound(np.empty(0), 0.5) == inf
    assert conformal.highest_level(families) == pytest.approx(8 / 9)
    random = np.random.default_rng(1)
    drawn = random.random((DRAWS, 40))
    held = np.mean([row[-1] <= upper_bound(row[:-1], 0.9) for row in drawn])
    # Of 40 exchangeable values the last is among the 36 smallest in 36 of 40 orders.
    assert held == pytest.approx(0.9, abs=4 * np.sqrt(0.09 / DRAWS))


def of_families(random, families, samples):
    """Values of samples that differ more between families than within: (K, n)."""
    return random.normal(size=(families, 1)) + 0.1 * random.normal(size=(families, samples))


def test_for_a_new_family_the_bound_by_families_holds_and_that_by_samples_does_not():
    random = np.random.default_rng(3)
    by_family, by_sample = [], []
    families = np.repeat(np.arange(11), 20)
    for _ in range(DRAWS):
        values = of_families(random, 12, 20)
        known, new = values[:-1].ravel(), values[-1]
        by_family.append((new <= upper_bound(known, 0.9, families)).mean())
        by_sample.append((new <= upper_bound(known, 0.9)).mean())
    deviation = np.std(by_family) / np.sqrt(DRAWS)
    assert np.mean(by_family) >= 0.9 - 4 * deviation
    assert np.mean(by_sample) < 0.9 - 4 * deviation


STATES = ("good", "poor", "lost")


def drawn(random, samples, mix=(0.6, 0.3, 0.1)):
    """Scores and states of samples: the third state is the hardest to see."""
    number_N = random.choice(3, samples, p=mix)
    logits = 1.5 * np.eye(3)[number_N] * np.array([1, 1, 0.3])[number_N, None] + random.normal(size=(samples, 3))
    scores = np.exp(logits)
    return scores / scores.sum(axis=1, keepdims=True), np.array(STATES)[number_N]


def held(sets, scores, state):
    return sets.of(scores)[np.arange(len(state)), [STATES.index(name) for name in state]]


def test_sets_hold_the_true_state_as_often_as_promised():
    random = np.random.default_rng(0)
    shares = []
    for _ in range(300):
        scores, state = drawn(random, 200)
        sets = conformal.calibrate_sets(scores[:100], state[:100], None, STATES, 0.9)
        shares.append(held(sets, scores[100:], state[100:]).mean())
    deviation = np.std(shares) / np.sqrt(300)
    assert 0.9 - 4 * deviation <= np.mean(shares) <= 0.9 + 1 / 101 + 0.03  # what is never empty covers a little more


def test_only_sets_by_state_hold_each_state_as_often_as_promised():
    random = np.random.default_rng(1)
    scores, state = drawn(random, 20000)
    tested, tested_state = drawn(random, 20000)
    share = {}
    for by_state in (False, True):
        sets = conformal.calibrate_sets(scores, state, None, STATES, 0.9, by_state=by_state)
        inside = held(sets, tested, tested_state)
        share[by_state] = [inside[tested_state == name].mean() for name in STATES]
    assert min(share[False]) < 0.8
    assert min(share[True]) > 0.885
    assert set(np.isfinite(sets.limits)) == {True}


def test_the_hardest_state_is_in_every_set_where_too_few_were_given_and_no_set_is_empty():
    scores, state = drawn(np.random.default_rng(2), 60)
    few = np.flatnonzero(state == "lost")[8:]
    kept = np.setdiff1d(np.arange(60), few)
    sets = conformal.calibrate_sets(scores[kept], state[kept], None, STATES, 0.9, by_state=True)
    assert sets.limits[2] == np.inf and sets.of(scores)[:, 2].all()
    scores = np.array([[0.9, 0.05, 0.05]] * 30)
    sets = conformal.calibrate_sets(scores, np.array(["good"] * 30), None, STATES, 0.9)
    asked = np.array([[0.3, 0.4, 0.3], [0.9, 0.05, 0.05]])
    assert sets.of(asked).tolist() == [[False, True, False], [True, False, False]]


@pytest.mark.parametrize(
    ("scores", "state", "level", "message"),
    [
        (np.ones((2, 4)), ["good", "good"], 0.9, r"scores: have the shape \(2, 4\) or are not finite; give a finite"),
        (np.full((2, 3), np.nan), ["good", "good"], 0.9, "scores: have the shape .* or are not finite"),
        (np.ones((2, 3)), ["good", "good"], 90, "level of the sets: 90 is not strictly between 0 and 1"),
    ],
)
def test_faults_are_one_line(scores, state, level, message):
    with pytest.raises(InputError, match=message):
        conformal.calibrate_sets(scores, np.array(state), None, STATES, level)


def alarm_drawn(random, samples, shift):
    """Scores of failure and whether each failed; the two kinds overlap where the shift is small."""
    failed_N = random.random(samples) < 0.6
    return random.normal(size=samples) + shift * failed_N, failed_N


def test_thresholds_by_hand():
    good, failed = np.arange(0, 39.0), np.arange(20, 59.0)
    alarm = conformal.calibrate_alarm(np.r_[good, failed], np.repeat([False, True], 39))
    assert alarm.good_below == 21 and np.floor(alarm.failed_from) == 37  # the 2nd of 40 from the end of either
    called = alarm.of(np.array([20.9, 21, 37, 37.1]))
    assert called.tolist() == [GOOD, NOT_SURE, NOT_SURE, ALARM]
    # Where the kinds are apart, one threshold keeps both risks.
    alarm = conformal.calibrate_alarm(np.r_[np.linspace(0, 1, 40), np.linspace(3, 4, 40)], np.repeat([False, True], 40))
    assert 1 < alarm.good_below == alarm.failed_from < 3
    assert NOT_SURE not in alarm.of(np.linspace(-1, 5, 100))


@pytest.mark.parametrize("shift", [1.0, 2.5, 6.0])
def test_both_risks_are_kept_on_average(shift):
    random = np.random.default_rng(5)
    missed, false_alarms = [], []
    for _ in range(400):
        failure, failed = alarm_drawn(random, 400, shift)
        alarm = conformal.calibrate_alarm(failure[:200], failed[:200])
        called, truth = alarm.of(failure[200:]), failed[200:]
        missed.append((called[truth] == GOOD).mean())
        false_alarms.append((called[~truth] == ALARM).mean())
    for risks in (missed, false_alarms):
        assert np.mean(risks) <= 0.05 + 4 * np.std(risks) / np.sqrt(400)


def test_from_too_few_samples_or_families_it_is_never_sure():
    few = conformal.calibrate_alarm(np.arange(36.0), np.repeat([False, True], 18))
    assert (few.good_below, few.failed_from) == (-inf, inf)
    families = np.tile(np.arange(12), 20)
    scores, failed = np.linspace(0, 1, 240), np.repeat([False, True], 120)
    assert set(conformal.calibrate_alarm(scores, failed, families).of(scores)) == {NOT_SURE}
    assert set(conformal.calibrate_alarm(scores, failed, families, 0.1, 0.1).of(scores)) == {GOOD, ALARM}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"missed": 0}, "risk of missed failures: 0 is not strictly between 0 and 1"),
        ({"false_alarms": 5}, "risk of false alarms: 5 is not strictly between 0 and 1"),
    ],
)
def test_faults_are_one_line_alarm(changes, message):
    arguments = {"failure_N": np.arange(4.0), "failed_N": np.array([True, False, True, False])} | changes
    with pytest.raises(InputError, match=message):
        conformal.calibrate_alarm(**arguments)
