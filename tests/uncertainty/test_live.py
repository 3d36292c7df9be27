import numpy as np
import pytest

from gpca.errors import InputError
from gpca.uncertainty.designs import ADDITIVE_KNOBS, LiveUncertainty, evaluate_design
from gpca.uncertainty.interventions import UNTOUCHED, Knobs
from gpca.uncertainty.settings import UncertaintySettings

SETTINGS = UncertaintySettings(starts=13, icp_points=60)


@pytest.fixture(scope="module")
def tests(registrations):
    return registrations.subset(registrations.rows("test")[:3])


@pytest.mark.parametrize("row", range(3))
def test_every_condition_has_the_value_of_the_table_in_any_order(tests, row):
    outcomes, *_ = evaluate_design("additive", tests, "tiny", 0, SETTINGS)
    live = LiveUncertainty(tests, row, "tiny", 0, SETTINGS)
    values = [live(knobs) for knobs in reversed(ADDITIVE_KNOBS)]
    assert values[::-1] == pytest.approx(outcomes.uncertainty[row], abs=1e-9)
    assert np.ptp(values) > 0
    assert live(UNTOUCHED) == 0


def test_nothing_is_kept_between_two_calls(tests):
    live = LiveUncertainty(tests, 0, "tiny", 0, SETTINGS)
    assert live.icp_calls == 13  # the clean run
    knobs = Knobs(0.02, 2.0, 0.2)
    assert live(knobs) == live(knobs)
    assert live.icp_calls == 3 * 13


def test_another_seed_has_other_starts(tests):
    one, other = (LiveUncertainty(tests, 0, "tiny", seed, SETTINGS)(Knobs(0.02, 3.0, 0.4)) for seed in (0, 1))
    assert one != other


def test_a_knob_outside_its_range_is_refused(tests):
    with pytest.raises(InputError, match=r"knob 'overlap': 0.99 is outside \[0, 0.95\]"):
        LiveUncertainty(tests, 0, "tiny", 0, SETTINGS)(Knobs(0.0, 1.0, 0.99))
