"""The alarm: its thresholds by hand, and its two risks in simulations."""

from math import inf

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.guarantee.conformal import ALARM, GOOD, NOT_SURE, FailureAlarm, calibrate_alarm


def drawn(random, samples, shift):
    """Scores of failure and whether each failed; the two kinds overlap where the shift is small."""
    failed_N = random.random(samples) < 0.6
    return random.normal(size=samples) + shift * failed_N, failed_N


def test_thresholds_by_hand():
    good, failed = np.arange(0, 39.0), np.arange(20, 59.0)
    alarm = calibrate_alarm(np.r_[good, failed], np.repeat([False, True], 39))
    assert alarm.good_below == 21 and np.floor(alarm.failed_from) == 37  # the 2nd of 40 from the end of either
    called = alarm.of(np.array([20.9, 21, 37, 37.1]))
    assert called.tolist() == [GOOD, NOT_SURE, NOT_SURE, ALARM]


def test_where_the_kinds_are_apart_one_threshold_keeps_both_risks():
    alarm = calibrate_alarm(np.r_[np.linspace(0, 1, 40), np.linspace(3, 4, 40)], np.repeat([False, True], 40))
    assert 1 < alarm.good_below == alarm.failed_from < 3
    assert NOT_SURE not in alarm.of(np.linspace(-1, 5, 100))


@pytest.mark.parametrize("shift", [1.0, 2.5, 6.0])
def test_both_risks_are_kept_on_average(shift):
    random = np.random.default_rng(5)
    missed, false_alarms = [], []
    for _ in range(400):
        failure, failed = drawn(random, 400, shift)
        alarm = calibrate_alarm(failure[:200], failed[:200])
        called, truth = alarm.of(failure[200:]), failed[200:]
        missed.append((called[truth] == GOOD).mean())
        false_alarms.append((called[~truth] == ALARM).mean())
    for risks in (missed, false_alarms):
        assert np.mean(risks) <= 0.05 + 4 * np.std(risks) / np.sqrt(400)


def test_with_confidence_few_thresholds_break_a_promise():
    random = np.random.default_rng(6)
    many, many_failed = drawn(random, 20000, 2.0)
    broken = {None: 0, 0.9: 0}
    for _ in range(300):
        failure, failed = drawn(random, 300, 2.0)
        for confidence in broken:
            called = calibrate_alarm(failure, failed, confidence=confidence).of(many)
            broken[confidence] += (called[many_failed] == GOOD).mean() > 0.05
    assert broken[0.9] <= 0.1 * 300 + 4 * np.sqrt(0.09 * 300) < broken[None]


def test_from_too_few_samples_or_families_it_is_never_sure():
    few = calibrate_alarm(np.arange(36.0), np.repeat([False, True], 18))
    assert (few.good_below, few.failed_from) == (-inf, inf)
    families = np.tile(np.arange(12), 20)
    scores, failed = np.linspace(0, 1, 240), np.repeat([False, True], 120)
    assert set(calibrate_alarm(scores, failed, families).of(scores)) == {NOT_SURE}
    assert set(calibrate_alarm(scores, failed, families, 0.1, 0.1).of(scores)) == {GOOD, ALARM}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"missed": 0}, "risk of missed failures: 0 is not strictly between 0 and 1"),
        ({"false_alarms": 5}, "risk of false alarms: 5 is not strictly between 0 and 1"),
        ({"confidence": 1}, "confidence of the alarm: 1 is not strictly between"),
        ({"confidence": 0.9, "family_N": np.zeros(4)}, "confidence of the alarm: is for single samples; leave out"),
        ({"failure_N": np.full(4, np.nan)}, "scores of failure: are not one finite number for each sample"),
    ],
)
def test_faults_are_one_line(changes, message):
    arguments = {"failure_N": np.arange(4.0), "failed_N": np.array([True, False, True, False])} | changes
    with pytest.raises(InputError, match=message):
        calibrate_alarm(**arguments)
    with pytest.raises(InputError, match="scores of failure"):
        FailureAlarm(0.05, 0.05, 0, 1).of(np.array([[0.5]]))
