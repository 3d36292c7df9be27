"""What the paper's own sampling leaves open of a number that it prints."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gpca.comparison.published import Number
from gpca.comparison.values import deviation_interval


@dataclass(frozen=True)
class Printed:
    """A printed number, or the range from `value` to `upper`.

    Attributes:
        rounding: half of its last digit.
        low, high: bounds of its 95 % interval; `value` and `upper` where its sampling error cannot be told.
    """

    value: float
    upper: float
    rounding: float
    low: float
    high: float


def printed_of(number: Number, deviation: Number | None = None) -> Printed:
    """Return the number with the interval that its sampling leaves.

    A share of n samples has Wilson's interval, a standard deviation of n repeats that of its chi-square, a mean whose
    standard deviation is printed Student's.

    Args:
        number: the printed one.
        deviation: the printed standard deviation of the same repeats.
    """
    low, high = number.value, number.upper
    if number.counterpart and number.counterpart.statistic == "deviation" and number.paper_n > 1:
        low, high = deviation_interval(number.value, number.paper_n)
    elif deviation and deviation.paper_n > 1:
        from scipy.stats import t as student_t

        half_width = student_t.ppf(0.975, deviation.paper_n - 1) * deviation.value / math.sqrt(deviation.paper_n)
        low, high = number.value - half_width, number.upper + half_width
    elif number.unit == "%" and number.paper_n:
        from scipy.stats import binomtest

        right = round(number.value / 100 * number.paper_n)
        interval = binomtest(right, number.paper_n).proportion_ci(method="wilson")
        # What is printed is rounded, and lies in its own interval nevertheless.
        low, high = min(100 * interval.low, number.value), max(100 * interval.high, number.value)
    return Printed(number.value, number.upper, number.rounding, float(low), float(high))
