"""The interval that the paper's own sampling leaves."""

from dataclasses import replace

import pytest
from scipy.stats import chi2

from gpca.comparison.verdicts import printed_of

from .made_up import ACCURACY, number


def test_a_share_of_so_many_samples_has_wilsons_interval():
    printed = printed_of(number(97.8, paper_n=180))
    centre, half_width = 96.753, 2.360  # of 176 in 180, by the formula of Wilson (1927)
    assert (printed.low, printed.high) == pytest.approx((centre - half_width, centre + half_width), abs=0.05)
    assert printed_of(number(100.0, paper_n=300)).high == 100
    assert printed_of(number(100.0, paper_n=300)).low == pytest.approx(100 * 300 / (300 + 1.959964**2))


def test_a_deviation_and_a_mean_beside_one_have_those_of_their_repeats():
    deviation = number(2.0, counterpart=replace(ACCURACY, statistic="deviation"), paper_n=5)
    own = printed_of(deviation)
    assert chi2.cdf(4 * (2.0 / own.low) ** 2, 4) == pytest.approx(0.975)
    assert chi2.cdf(4 * (2.0 / own.high) ** 2, 4) == pytest.approx(0.025)
    mean = printed_of(number(85.0), deviation)
    assert mean.high - 85 == pytest.approx(2.776445 * 2 / 5**0.5)
    assert 85 - mean.low == pytest.approx(mean.high - 85)


def test_what_tells_no_sample_is_exact():
    printed = printed_of(number(350.0, 550.0, -1, "labels"))
    assert (printed.low, printed.high, printed.rounding) == (350, 550, 5)
