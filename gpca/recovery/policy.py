"""The policy for uncertain registrations: from concept scores to one of four branches (paper Sec. V, Fig. 6).

A case is queued for labeling where the classifier is uncertain about it or no concept dominates; else the dominant
concept is treated: reinitialize ICP with a broader search (pose), change the viewpoint (overlap), filter and check the
sensor (noise). After each action the scores are computed again, and after a few attempts that improved too little
the case is queued as well.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from gpca.errors import InputError
from gpca.pairs.perturbation import CONCEPTS
from gpca.settings import NotNegative, Share

NOTHING = "nothing"  # the branch of a registration that is fine
QUEUE = "queue"  # the branch that acts no more: a person labels the case, and the classifier learns it
TREATMENTS = {"noise": "denoise", "pose": "reinitialize", "overlap": "new_view"}  # the paper maps them so


@dataclass(frozen=True)
class Thresholds:
    """When which branch is taken.

    Attributes:
        uncertain: a case is queued where its BALD, in nats, is above this.
        dominant: a concept is treated from this score on; with less, none dominates and the case is queued.
        improvement: an action counts as an improvement where the treated concept's score falls by this or more.
        attempts: after so many actions without improvement the case is queued.
    """

    uncertain: NotNegative = np.inf
    dominant: Share = 0.0
    improvement: Share = 0.1
    attempts: int = 3

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
    """An action that was taken: for which concept, and by how much that concept's score fell."""

    concept: str
    fall: float


@dataclass(frozen=True)
class Decision:
    """A branch: the action, or `QUEUE`; the concept that it treats, empty where none; why, in words."""

    action: str
    concept: str
    reason: str


@dataclass(frozen=True)
class RecoveryPolicy:
    """The mapping of Fig. 6.

    Attributes:
        thresholds: see :class:`Thresholds`.
        treatments: concept -> action.
    """

    thresholds: Thresholds = field(default_factory=Thresholds)
    treatments: Mapping[str, str] = field(default_factory=lambda: dict(TREATMENTS))

    @classmethod
    def of_settings(
        cls, thresholds: Mapping[str, float | None], treatments: Mapping[str, str], attempts: int, bald_N: np.ndarray
    ) -> RecoveryPolicy:
        """Build it from the config's thresholds; its `uncertain`, where null, is chosen on calibration samples.

        Args:
            attempts: see :class:`Thresholds`.
            bald_N: the uncertainties of the calibration samples (:func:`choose_uncertain`).
        """
        declared = {name: value for name, value in thresholds.items() if value is not None}
        queued_share = declared.pop("queued_share")
        if "uncertain" not in declared:
            declared["uncertain"] = choose_uncertain(bald_N, queued_share)
        return cls(Thresholds(**declared, attempts=attempts), dict(treatments))

    def decide(
        self,
        scores_C: np.ndarray,
        bald: float = 0.0,
        before: Sequence[Treated] = (),
        concepts: Sequence[str] = CONCEPTS,
    ) -> Decision:
        """Choose the branch for one case.

        Of the concepts, those come last whose treatment improved too little before, and of those the ones that were
        treated least often first; otherwise the largest score leads.

        Args:
            scores_C: scores ŝ_c that sum to one.
            bald: uncertainty in nats; 0 where an explainer has none.
            before: the actions taken in this case so far, in order.
        """
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
        chosen = concepts[min(treatable, key=lambda c: (stale.count(concepts[c]), -scores_C[c]))]
        return Decision(self.treatments[chosen], chosen, f"{chosen} has {scores_C[concepts.index(chosen)]:.2f}")


def choose_uncertain(bald_N: np.ndarray, queued_share: float) -> float:
    """Return the BALD in nats that at most so large a share of calibration samples exceeds.

    So the share of cases that are left to a person is declared, and what is queued are those that the classifier
    knows least about.

    Args:
        bald_N: uncertainties of samples that the classifier did not learn.
        queued_share: the share, in [0, 1).

    Raises:
        InputError: no samples, or a share out of range.
    """
    if not 0 <= queued_share < 1:
        raise InputError("recovery.thresholds.queued_share", f"{queued_share} is not in [0, 1)", "give a share")
    if not len(bald_N):
        raise InputError("recovery", "has no calibration samples", "raise recovery.calibration")
    return float(np.quantile(bald_N, 1 - queued_share, method="inverted_cdf"))
