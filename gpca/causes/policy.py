"""The recovery policy: from concept scores to one of four branches (paper Sec. V, Fig. 6)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from gpca.errors import InputError
from gpca.pairs.perturbation import CONCEPTS
from gpca.settings import NotNegative, Share

NOTHING = "nothing"  # branch of a good registration
QUEUE = "queue"  # branch in which a person labels the case for the classifier
TREATMENTS = {"noise": "denoise", "pose": "reinitialize", "overlap": "new_view"}  # as in the paper


@dataclass(frozen=True)
class Thresholds:
    """Conditions of the branches."""

    uncertain: NotNegative = np.inf  # BALD in nats above which a case is queued
    dominant: Share = 0.0  # score from which a concept is treated; otherwise none dominates and the case is queued
    improvement: Share = 0.1  # least decrease of the treated concept's score that counts as an improvement
    attempts: int = 3  # actions without improvement after which the case is queued

    def __post_init__(self) -> None:
        if not 0 <= self.improvement <= 1 or not 0 <= self.dominant <= 1:
            both = f"improvement {self.improvement} and dominant {self.dominant}"
            raise InputError("recovery thresholds", f"{both} are not both in [0, 1]", "they are shares of a score")
        if self.dominant and self.improvement >= self.dominant:
            fault = f"improvement {self.improvement} is not below dominant {self.dominant}"
            raise InputError("recovery thresholds", fault, "a score cannot fall by more than its own value")
        if not self.uncertain >= 0 or self.attempts < 1:
            fault = f"uncertain {self.uncertain}, attempts {self.attempts}"
            raise InputError("recovery thresholds", fault, "give an uncertainty of 0 or more and at least 1 attempt")


@dataclass(frozen=True)
class Treated:
    """An earlier action: the treated concept, and the decrease of its score."""

    concept: str
    fall: float


@dataclass(frozen=True)
class Decision:
    """A branch: the action, or `QUEUE`; the treated concept, or empty; and the reason."""

    action: str
    concept: str
    reason: str


@dataclass(frozen=True)
class RecoveryPolicy:
    """The mapping of Fig. 6; `treatments` maps concepts to actions."""

    thresholds: Thresholds = field(default_factory=Thresholds)
    treatments: Mapping[str, str] = field(default_factory=lambda: dict(TREATMENTS))

    @classmethod
    def of_settings(
        cls, thresholds: Mapping[str, float | None], treatments: Mapping[str, str], attempts: int, bald_N: np.ndarray
    ) -> RecoveryPolicy:
        """Build a policy from the config; if null, `uncertain` is chosen on BALD of calibration samples."""
        declared = {name: value for name, value in thresholds.items() if value is not None}
        queued_share = declared.pop("queued_share")
        if "uncertain" not in declared:
            declared["uncertain"] = choose_uncertain(bald_N, queued_share)
        return cls(Thresholds(**declared, attempts=attempts), dict(treatments))

    def decide(
        self, scores_C: np.ndarray, bald: float = 0, before: Sequence[Treated] = (), concepts: Sequence[str] = CONCEPTS
    ) -> Decision:
        """Choose the branch of a case by scores ŝ_c that sum to one, and BALD in nats; 0 for explainers without one."""
        limits = self.thresholds
        stale = [treated.concept for treated in before if treated.fall < limits.improvement]
        if len(stale) >= limits.attempts:
            return Decision(QUEUE, "", f"{len(stale)} actions improved too little")
        if bald > limits.uncertain:
            return Decision(QUEUE, "", f"uncertain: BALD {bald:.3f} above {limits.uncertain:.3f}")
        top = int(np.argmax(scores_C))
        if scores_C[top] < limits.dominant:
            return Decision(QUEUE, "", f"no concept dominates: {concepts[top]} has {scores_C[top]:.2f}")
        treatable = [c for c, concept in enumerate(concepts) if concept in self.treatments]
        if not treatable or top not in treatable:
            return Decision(QUEUE, "", f"no action treats {concepts[top]}")
        # Concepts whose treatment improved too little come last, the least often treated first.
        chosen = concepts[min(treatable, key=lambda c: (stale.count(concepts[c]), -scores_C[c]))]
        return Decision(self.treatments[chosen], chosen, f"{chosen} has {scores_C[concepts.index(chosen)]:.2f}")


def choose_uncertain(bald_N: np.ndarray, queued_share: float) -> float:
    """Return the BALD in nats that at most this share, to be queued, of samples not used for training exceeds."""
    if not 0 <= queued_share < 1:
        raise InputError("recovery.thresholds.queued_share", f"{queued_share} is not in [0, 1)", "give a share")
    if not len(bald_N):
        raise InputError("recovery", "has no calibration samples", "raise recovery.calibration")
    return float(np.quantile(bald_N, 1 - queued_share, method="inverted_cdf"))
