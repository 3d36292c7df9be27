"""What is said of one registration: pose, uncertainty, causes with their scores, and what to do."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gpca.recovery.policy import QUEUE

WORDS = {  # what a reader is told of each branch
    "reinitialise": "reinitialise ICP with a broader search",
    "new_view": "change the viewpoint",
    "denoise": "filter and check the sensor",
    QUEUE: "queue for labelling: tell the cause, and learn it",
}


@dataclass(frozen=True)
class PoseSpread:
    """How far poses scatter when ICP starts elsewhere: Σ (6, 6) of twists in radians and diameters, over n starts."""

    covariance_6_6: np.ndarray
    starts: int
    diameter: float

    @property
    def rotation_deg(self) -> float:
        """Root mean square angle."""
        return math.degrees(math.sqrt(np.trace(self.covariance_6_6[:3, :3])))

    @property
    def translation(self) -> float:
        """Root mean square length, in the unit of the points."""
        return self.diameter * math.sqrt(np.trace(self.covariance_6_6[3:, 3:]))


@dataclass(frozen=True)
class Explanation:
    """One registration, how uncertain it is, and why.

    Attributes:
        T_target_source: the pose (4, 4) that was found, in the unit of the points.
        fitness, inlier_rmse: share of source points with a correspondence; RMSE over those, in the unit of the points.
        method: that found it: the model's kind of ICP, or a registration method by its name.
        scores, variances: mean and variance over the posterior draws for each concept (Eqs. 4, 5).
        bald, entropy: how uncertain the attribution is, in nats: Eq. 7, and the entropy of the scores.
        concept: the one with the largest score (Eq. 6).
        action: what to do next: a branch of the policy (:mod:`gpca.recovery.policy`).
        reason: why this action, in words.
        spread: how far the pose scatters by Monte-Carlo ICP, where it was asked for.
        unit: that of all lengths.
        seconds: those of each stage, and ``total``.
        notes: what a reader has to know, such as points that were left out.
    """

    T_target_source: np.ndarray
    fitness: float
    inlier_rmse: float
    method: str
    scores: dict[str, float]
    variances: dict[str, float]
    bald: float
    entropy: float
    concept: str
    action: str
    reason: str
    spread: PoseSpread | None
    unit: str
    seconds: dict[str, float]
    notes: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, object]:
        """Return it as numbers, lists and names, for JSON."""
        spread = self.spread and {
            "rotation_deg": self.spread.rotation_deg,
            "translation": self.spread.translation,
            "covariance": self.spread.covariance_6_6.tolist(),
            "starts": self.spread.starts,
        }
        return vars(self) | {
            "T_target_source": self.T_target_source.tolist(),
            "spread": spread,
            "notes": list(self.notes),
        }

    def text(self) -> str:
        """Return it for a reader."""
        lines = [
            f"concept   {self.concept}",
            f"action    {WORDS.get(self.action, self.action)} ({self.reason})",
            "",
            f"{'':10}{'score':>8}{'variance':>10}",
            *(f"{name:10}{self.scores[name]:8.3f}{self.variances[name]:10.4f}" for name in self.scores),
            "",
            f"attribution    entropy {self.entropy:.3f} nats, BALD {self.bald:.3f} nats",
            f"registration   {self.method}, fitness {self.fitness:.3f}, inlier RMSE {self.inlier_rmse:.4g} {self.unit}",
        ]
        if self.spread is not None:
            scatter = f"{self.spread.rotation_deg:.2f}°, {self.spread.translation:.4g} {self.unit}"
            lines.append(f"pose spread    {scatter} (root mean square over {self.spread.starts} starts)")
        lines += ["", f"T_target_source, in {self.unit}"]
        lines += [" ".join(f"{number:12.6g}" for number in row) for row in self.T_target_source]
        stages = ", ".join(f"{stage} {1e3 * seconds:.1f}" for stage, seconds in self.seconds.items())
        return "\n".join([*lines, "", f"milliseconds   {stages}", ""])
