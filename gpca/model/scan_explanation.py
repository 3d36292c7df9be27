"""What is said of a registration of a scan to a scan; nothing of it was learned."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from html import escape
from pathlib import Path

import numpy as np

from gpca.causes.truth import FAILED, NOMINAL
from gpca.io.files import whole_file
from gpca.model.advice import WORDS
from gpca.model.reenacted import Reenacted
from gpca.model.scene import Scene
from gpca.model.shown import parts
from gpca.model.shown.packing import packed_scene
from gpca.model.shown.page import assembled, framed

NOT_SURE = "not sure"
LEARNED = (
    "nothing was learned from scans: this is the untrained re-enactment, and the model, which learned from objects, "
    "is not used"
)
HEADS = {
    NOMINAL: ("good", "Nothing speaks against this registration"),
    FAILED: ("bad", "This registration has probably failed"),
    NOT_SURE: ("doubt", "This registration may have failed"),
}
WITHOUT = {"noise": "smoothed points", "pose": "right start", "overlap": "common parts alone"}


@dataclass(frozen=True)
class ScanExplanation:
    """One registration of two scans of a scene, of which neither holds all of the other.

    Attributes:
        T_target_source: the pose (4, 4) that was found, in the unit of the points.
        fitness, inlier_rmse: share of the source's voxels that have a partner within two voxels; RMSE over those.
        method: that found it.
        voxel: edge of the voxels.
        state: ``nominal``, ``failed`` or ``not sure``.
        failure: how probable a failure is (:mod:`gpca.model.scan_verdict`); not calibrated.
        limit: error from which a registration counts as failed: root mean square over the common surface.
        overlap: share of the source that lies on the target, and of the target that lies on the source.
        reenacted: the poses that fit, and what each cause does.
        action, reason: what to do next, a branch of the policy, and why.
        unit: that of all lengths.
        seconds: that it took.
        notes, warnings: what was done to the clouds, and reasons to doubt all this.
        learned_from: that nothing was.
        scene: what it is drawn from.
    """

    T_target_source: np.ndarray
    fitness: float
    inlier_rmse: float
    method: str
    voxel: float
    state: str
    failure: float
    limit: float
    overlap: tuple[float, float]
    reenacted: Reenacted
    action: str
    reason: str
    unit: str
    seconds: float
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    learned_from: str = LEARNED
    scene: Scene | None = field(default=None, repr=False, compare=False)

    @property
    def advice(self) -> str:
        """What to do next, in words."""
        return WORDS[self.action]

    def as_dict(self) -> dict[str, object]:
        """Return it as numbers, lists and names, for JSON."""
        told = {name: value for name, value in vars(self).items() if name != "scene"}
        lists = {name: list(getattr(self, name)) for name in ("overlap", "notes", "warnings")}
        return told | lists | {"T_target_source": self.T_target_source.tolist(), "reenacted": self.reenacted.as_dict()}

    def text(self) -> str:
        """Return it for a reader."""
        effects = ", ".join(f"{cause} {effect:.2g}" for cause, effect in self.reenacted.effects.items())
        shares = zip(self._poses(), self.reenacted.poses, strict=True)
        lines = [
            *(f"warning   {line}" for line in self.warnings),
            f"state     {self.state}",
            f"failure   probability {self.failure:.2f}, not calibrated, of an error above {self._long(self.limit)}",
            f"overlap   {self._overlap()}",
            f"effects   on the re-enacted error of {self._long(self.reenacted.error)}: {effects}",
            *(f"pose {k}    {words}: probability {pose.probability:.2f}" for k, (words, pose) in enumerate(shares, 1)),
            f"action    {self.advice} ({self.reason})",
            "",
            f"registration   {self.method}, fitness {self.fitness:.3f}, inlier RMSE {self._long(self.inlier_rmse)}, "
            f"voxels of {self._long(self.voxel)}",
            "",
            f"T_target_source, in {self.unit}",
            *(" ".join(f"{number:12.6g}" for number in row) for row in self.T_target_source),
        ]
        return "\n".join([*lines, ""])

    def html(self, names: Mapping[str, str] | None = None) -> str:
        """Return it as a page of its own, as :meth:`gpca.model.explanation.Explanation.html` does."""
        tone, said = HEADS[self.state]
        told = self.as_dict()
        doubt = f"Probability of failure {self.failure:.2f}, not calibrated: {self.learned_from}."
        head = f'<h1 class="{tone}">{said}</h1><p>{escape(doubt)}</p>{parts.warnings(self.warnings)}'
        scene = self.scene
        possibilities = scene.possibilities if scene else ()
        size = scene.frame.diameter if scene else 1.0
        errors = [[size * what_if.error for what_if in each.what_ifs] for each in possibilities]
        body = [
            parts.action(told, self.advice),
            parts.section("Overlap", f"<p>{escape(self._overlap())}.</p>"),
            parts.poses(self._poses() if possibilities else [], self.reenacted.poses),
            parts.counterfactuals(errors, self.limit, self.unit, WITHOUT),
            parts.details(told, {"training": self.learned_from, "voxels": self._long(self.voxel)} | dict(names or {})),
        ]
        return assembled("Scans explained", head, body, packed_scene(scene, self.unit) if scene else None)

    def save_html(self, path: str | Path, names: Mapping[str, str] | None = None) -> None:
        """Write :meth:`html` to a file."""
        with whole_file(path) as partial:
            partial.write_text(self.html(names), encoding="utf-8")

    def _repr_html_(self) -> str:
        """Return the page as a notebook shows it."""
        return framed(self.html())

    def _poses(self) -> list[str]:
        return [f"the source {words}" for words in self.reenacted.words(self.unit)]

    def _overlap(self) -> str:
        of_source, of_target = self.overlap
        return f"{of_source:.0%} of the source lies on the target, {of_target:.0%} of the target on the source"

    def _long(self, value: float) -> str:
        return parts.length(value, self.unit)
