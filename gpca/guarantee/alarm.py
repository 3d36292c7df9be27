"""An alarm with two bounded risks: failures that are called good, and good registrations that are called failed.

Where one threshold cannot keep both risks, there are two, and between them the alarm is not sure.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from gpca.errors import InputError
from gpca.guarantee.quantile import confident_upper_bound, require_share, upper_bound

GOOD, NOT_SURE, ALARM = OUTCOMES = ("good", "not sure", "failed")


@dataclass(frozen=True)
class FailureAlarm:
    """The two thresholds, and what they promise.

    Attributes:
        missed: largest probability that a failed registration is called good.
        false_alarms: largest probability that a good one is called failed.
        good_below: score of failure below which a registration is called good; negative infinity where too few failed
            samples were given to promise anything, so that none is.
        failed_from: score from which it is called failed; infinity where too few good ones were given.
        confidence: with which both hold for these very thresholds; None where they hold on average over draws of the
            samples that the thresholds were set on.
    """

    missed: float
    false_alarms: float
    good_below: float
    failed_from: float
    confidence: float | None = None

    def of(self, failure_M: np.ndarray) -> np.ndarray:
        """Return what each of M registrations is called, of `OUTCOMES`, from its score of failure."""
        require_failures(failure_M)
        called = [failure_M < self.good_below, failure_M >= self.failed_from]
        return np.select(called, [GOOD, ALARM], NOT_SURE)


def calibrate_alarm(
    failure_N: np.ndarray,
    failed_N: np.ndarray,
    family_N: np.ndarray | None = None,
    missed: float = 0.05,
    false_alarms: float = 0.05,
    confidence: float | None = None,
) -> FailureAlarm:
    """Return the alarm that misses, and falsely alarms, with at most these probabilities.

    A failed registration is missed with at most the probability that it has a score below the bound that failed ones
    seldom fall below (conformal risk control, Angelopoulos et al. 2024, of a loss that is 0 or 1), and a good one
    likewise. Where the bounds leave a gap in which both calls are allowed, the threshold is its middle.

    Args:
        failure_N: score of failure of samples that nothing was learned from, the larger the surer.
        failed_N: whether each failed; the others are good.
        family_N: of every sample; see :func:`gpca.guarantee.quantile.upper_bound`.
        confidence: promise by :func:`gpca.guarantee.quantile.confident_upper_bound` instead.

    Raises:
        InputError: scores that are not finite, risks or a confidence that are no shares, a confidence for families, of
            which there are never enough.
    """
    require_share("risk of missed failures", missed)
    require_share("risk of false alarms", false_alarms)
    require_failures(failure_N)
    if confidence is not None:
        require_share("confidence of the alarm", confidence)
        if family_N is not None:
            raise InputError("confidence of the alarm", "is for single samples", "leave out either it or the families")

    def bound(value_N: np.ndarray, of_N: np.ndarray, risk: float) -> float:
        if confidence is not None:
            return confident_upper_bound(value_N[of_N], 1 - risk, confidence)
        return upper_bound(value_N[of_N], 1 - risk, None if family_N is None else family_N[of_N])

    good_below = -bound(-failure_N, failed_N, missed)
    largest_good = bound(failure_N, ~failed_N, false_alarms)
    failed_from = float(np.nextafter(largest_good, inf))
    if good_below > failed_from:
        good_below = failed_from = (good_below + failed_from) / 2
    return FailureAlarm(missed, false_alarms, good_below, failed_from, confidence)


def require_failures(failure_N: np.ndarray) -> None:
    """Raise an InputError unless every score is one finite number."""
    if failure_N.ndim != 1 or not np.isfinite(failure_N).all():
        raise InputError("scores of failure", "are not one finite number for each sample", "leave out the others")
