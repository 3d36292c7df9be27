"""What is said of one registration: whether it failed, for which causes, and what that rests on."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np

from gpca.alignment.canonical_frame import CanonicalFrame
from gpca.causes.truth import FAILED, NOMINAL
from gpca.model.guaranteed import Guaranteed
from gpca.model.reenacted import Reenacted

UNKNOWN = "unknown"  # the state of a diagnosis without meaning
LIKELY = 0.5  # probability from which a concept is called one of the causes


@dataclass(frozen=True)
class Diagnosis:
    """The diagnosis of one registration.

    Attributes:
        failure: probability that it failed.
        threshold: of that probability, from which something is called wrong.
        causes: probability of each concept that it is one of the causes, if there are any.
        variances: of these over the posterior draws (Eq. 5).
        bald: of the least certain of these probabilities, nats (Eq. 7).
        expected_error: of the pose: ADD, or ADD-S of a symmetric object.
        unlikeness: how unlike the training samples the pair is: 1 % of these are above 1.
        void: whether the pair is such that none of these numbers means anything (:mod:`gpca.model.familiarity`).
        guarantee: the set of states that holds the true one with a promised probability; None of older models.
        reenacted: the counterfactuals that this rests on, under hypotheses of the true pose; None where nothing was
            re-enacted.
    """

    failure: float
    threshold: float
    causes: dict[str, float]
    variances: dict[str, float]
    bald: float
    expected_error: float
    unlikeness: float = 0.0
    void: bool = False
    guarantee: Guaranteed | None = None
    reenacted: Reenacted | None = None

    @property
    def state(self) -> str:
        """``nominal``, ``failed`` or ``unknown``."""
        if self.void:
            return UNKNOWN
        return NOMINAL if self.failure < self.threshold else FAILED

    @property
    def named(self) -> tuple[str, ...]:
        """The causes that are more likely than not, the likeliest first, and at least that one; none unless failed."""
        if self.state != FAILED:
            return ()
        first, *rest = sorted(self.causes, key=lambda cause: -self.causes[cause])
        return first, *(cause for cause in rest if self.causes[cause] >= LIKELY)

    def outside(self, frame: CanonicalFrame, T_target_source_init: np.ndarray) -> Diagnosis:
        """Return it in the user's frame and unit of length, where it was in the canonical frame of the target."""
        reenacted = self.reenacted and self.reenacted.outside(frame, T_target_source_init)
        return replace(self, expected_error=self.expected_error * frame.diameter, reenacted=reenacted)

    def as_dict(self) -> dict[str, object]:
        """Return it as numbers, lists and names, for JSON."""
        parts = {
            "guarantee": self.guarantee and asdict(self.guarantee),
            "reenacted": self.reenacted and self.reenacted.as_dict(),
        }
        return vars(self) | parts | {"state": self.state, "named": list(self.named)}

    def lines(self, unit: str) -> list[str]:
        """Return it for a reader, with lengths in this unit."""
        named = " and ".join(self.named) or "nothing is wrong"
        return [
            f"state     {self.state}: {named}",
            f"failure   probability {self.failure:.3f}, called a failure from {self.threshold:.3f}",
            *(self.guarantee.lines() if self.guarantee else ["set       none, since nothing is promised"]),
            f"causes    {', '.join(f'{cause} {share:.3f}' for cause, share in self.causes.items())}, if it failed",
            f"error     about {self.expected_error:.2g} {unit}",
            *(self.reenacted.lines(unit) if self.reenacted else ["          (nothing was re-enacted)"]),
        ]
