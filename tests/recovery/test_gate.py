import numpy as np
import pytest

from gpca.errors import InputError
from gpca.recovery.chances import alarm_threshold, learn_gate


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


def test_the_threshold_is_set_on_good_ones_of_tables_that_were_not_learned():
    """Each table has a place of its own: a classifier that has learned it would know its registrations."""
    random = np.random.default_rng(1)
    table_N = np.repeat(np.arange(10), 4)
    failed_N = np.tile([True, False, False, False], 10)
    observed_N_F = random.normal(size=(40, 40))  # as many numbers as registrations: all can be told apart by heart
    gate = learn_gate(observed_N_F, failed_N, table_N, 0.2)
    by_heart = np.sort(gate.failure(observed_N_F[~failed_N]))
    assert gate.threshold > by_heart[-6]


def test_the_threshold_has_the_rank_of_conformal_prediction():
    values = np.arange(1, 20) / 20
    assert alarm_threshold(values, 0.05) == values[-1]  # the 19th of 19
    assert alarm_threshold(values, 0.1) == values[-2]
    assert alarm_threshold(values[:5], 0.05) == values[4]


@pytest.mark.parametrize(
    ("failed", "kind"), [([True] * 6, "good"), ([False] * 6, "failed"), ([True, True] + [False] * 4, "failed")]
)
def test_a_gate_needs_failures_and_good_ones_on_two_tables(failed, kind):
    with pytest.raises(InputError, match=f"that are {kind} stand on . of the two tables"):
        learn_gate(np.zeros((6, 2)), np.array(failed), [0, 0, 1, 1, 2, 2], 0.05)
