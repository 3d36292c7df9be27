"""Settings of the promises: nothing here needs the code that keeps them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from gpca.settings import OpenShare


@dataclass(frozen=True)
class GuaranteeSettings:
    """What is promised.

    Attributes:
        level: probability that a set holds the true state.
        missed, false_alarms: largest probabilities that a failed registration is called good, and a good one failed.
        family_risk: both where the promise is for new families, of which there are too few for a smaller one.
        confidence: with which both hold for the very thresholds, in a row of their own.
        nonconformity: how ill a state fits (:func:`gpca.guarantee.conformal.nonconformity`).
    """

    level: OpenShare = 0.9
    missed: OpenShare = 0.05
    false_alarms: OpenShare = 0.05
    family_risk: OpenShare = 0.1
    confidence: OpenShare = 0.9
    nonconformity: Literal["probability", "cumulative"] = "probability"
