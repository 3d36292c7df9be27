"""An explanation of one registration: the pose, whether it is right, the causes if it is not, and the next action."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from gpca.io.files import whole_file
from gpca.model.advice import CHECK, WORDS
from gpca.model.diagnosis import UNKNOWN, Diagnosis
from gpca.model.scene import Scene
from gpca.model.shown.page import framed, page


@dataclass(frozen=True)
class PoseSpread:
    """How uncertain the pose is.

    Attributes:
        covariance_6_6: Σ of twists on the left of the pose, in radians and diameters.
        diameter: of the target, in the unit of the points.
        estimator: that says so.
        starts: of Monte-Carlo; None of another estimator.
    """

    covariance_6_6: np.ndarray
    diameter: float
    estimator: str
    starts: int | None

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
    """One registration, whether it is right, and why it is not.

    Attributes:
        T_target_source: the pose (4, 4) that was found, in the unit of the points.
        fitness, inlier_rmse: share of source points with a correspondence; RMSE over those, in the unit of the points.
        method: that found it: the model's kind of ICP, or a registration method by its name.
        diagnosis: of the pair, learned from measured causes, its expected error in the unit of the points; None where
            it was not asked for.
        scores, variances: of GP-CA as in the paper, which sees the aligned source alone and always names a concept:
            mean and variance over the posterior draws (Eqs. 4, 5).
        bald, entropy: how uncertain these are, in nats: Eq. 7, and the entropy of the scores.
        concept: the one with the largest score (Eq. 6).
        action: what to do next: a branch of the policy (:mod:`gpca.recovery.policy`), or `CHECK`.
        reason: why this action, in words.
        spread: how uncertain the pose is by an estimator, where it was asked for and could tell.
        unit: that of all lengths.
        seconds: those of each stage, and ``total``.
        notes: what was done to the clouds, such as points that were left out.
        warnings: why this explanation is not to be relied on: what is unlike all that the model learned.
        learned_from: what the diagnosis learned from, in words.
        scene: what it is drawn from (:meth:`html`); None where it came as one of many.
    """

    T_target_source: np.ndarray
    fitness: float
    inlier_rmse: float
    method: str
    diagnosis: Diagnosis | None
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
    warnings: tuple[str, ...] = ()
    learned_from: str = ""
    scene: Scene | None = field(default=None, repr=False, compare=False)

    @property
    def unknown(self) -> bool:
        """Whether the pair is such that neither diagnosis nor scores mean anything."""
        return self.action == CHECK

    @property
    def advice(self) -> str:
        """What to do next, in words."""
        return WORDS.get(self.action, self.action)

    def as_dict(self) -> dict[str, object]:
        """Return it as numbers, lists and names, for JSON."""
        spread = self.spread and {
            "rotation_deg": self.spread.rotation_deg,
            "translation": self.spread.translation,
            "covariance": self.spread.covariance_6_6.tolist(),
            "estimator": self.spread.estimator,
            "starts": self.spread.starts,
        }
        told = {name: value for name, value in vars(self).items() if name != "scene"}
        return told | {
            "T_target_source": self.T_target_source.tolist(),
            "diagnosis": self.diagnosis and self.diagnosis.as_dict(),
            "spread": spread,
            "notes": list(self.notes),
            "warnings": list(self.warnings),
        }

    def html(self, names: Mapping[str, str] | None = None) -> str:
        """Return it as a page of its own, without any other file: both clouds in 3-D, causes, poses, counterfactuals.

        Args:
            names: of the files and the model, which the page lists.
        """
        reenacted = self.diagnosis.reenacted if self.diagnosis else None
        # Poses of a pair without meaning would mean nothing either.
        scene = replace(self.scene, enact=None) if self.scene is not None and self.unknown else self.scene
        named = {"training": self.learned_from} | dict(names or {})
        return page(self.as_dict(), self.advice, reenacted, scene, named)

    def save_html(self, path: str | Path, names: Mapping[str, str] | None = None) -> None:
        """Write :meth:`html` to a file."""
        with whole_file(path) as partial:
            partial.write_text(self.html(names), encoding="utf-8")

    def _repr_html_(self) -> str:
        """Return the page as a notebook shows it."""
        return framed(self.html())

    def text(self) -> str:
        """Return it for a reader."""
        action = f"action    {self.advice} ({self.reason})"
        registered = (
            f"registration   {self.method}, fitness {self.fitness:.3f}, inlier RMSE {self.inlier_rmse:.4g} {self.unit}"
        )
        doubts = [f"warning   {line}" for line in self.warnings]
        diagnosed = self.diagnosis.lines(self.unit) if self.diagnosis else []
        body = [*diagnosed, action, "", *self._attributed()]
        lines = [*doubts, *([f"state     {UNKNOWN}", action] if self.unknown else body), "", registered]
        if self.spread is not None:
            scatter = f"{self.spread.rotation_deg:.2f}°, {self.spread.translation:.4g} {self.unit}"
            by = f"over {self.spread.starts} starts" if self.spread.starts else f"by {self.spread.estimator}"
            lines.append(f"pose spread    {scatter} (root mean square {by})")
        lines += ["", f"T_target_source, in {self.unit}"]
        lines += [" ".join(f"{number:12.6g}" for number in row) for row in self.T_target_source]
        stages = ", ".join(f"{stage} {1e3 * seconds:.1f}" for stage, seconds in self.seconds.items())
        return "\n".join([*lines, "", f"milliseconds   {stages}", ""])

    def _attributed(self) -> list[str]:
        return [
            "GP-CA as in the paper: it sees the aligned source alone and names a concept even where nothing is wrong",
            f"{'':10}{'score':>8}{'variance':>10}",
            *(f"{name:10}{self.scores[name]:8.3f}{self.variances[name]:10.4f}" for name in self.scores),
            f"entropy {self.entropy:.3f} nats, BALD {self.bald:.3f} nats",
        ]
