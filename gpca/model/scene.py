"""The data of the 3-D view of one registration: clouds, poses and re-enacted registrations, also packed as JSON."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from gpca.causes.candidate import Registrar, Unmeasurable
from gpca.causes.settings import CauseSettings
from gpca.causes.truth import BY_SIZE, SUBSETS
from gpca.objects.canonical import CanonicalFrame
from gpca.pairs.perturbation import CONCEPTS
from gpca.reenactment.enactment import Enactment
from gpca.reenactment.hypotheses import weights_of
from gpca.rigid import transform

ASSETS = Path(__file__).with_name("assets")  # style and script of the view
MOST_POINTS = 3000  # per cloud; more points hide one another
LARGEST_STEP = 2**15 - 1
FARTHEST = 4.0  # largest radius of the view around the target's center, in diameters
WITHOUT = {"noise": "clean points", "pose": "right start", "overlap": "whole surface"}  # what removing a cause means


@dataclass(frozen=True)
class Possibility:
    """A hypothesis of the true pose, with its re-enacted registrations in the target's frame and in its diameters."""

    probability: float  # among all hypotheses
    T: np.ndarray  # (4, 4) maps the source at its initial pose to the hypothesis
    errors: tuple[float, ...]  # v̂, the mean over the starts, for each subset of the causes that is left in
    clouds: tuple[np.ndarray, ...]  # (P, 3) for each subset, the source after ICP from the unperturbed start


@dataclass(frozen=True)
class Scene:
    """A registration in the target's canonical frame and in its diameters."""

    source: np.ndarray  # (N, 3) at its initial pose
    target: np.ndarray  # (M, 3)
    T_found: np.ndarray  # (4, 4) maps the source from the initial pose to the result
    frame: CanonicalFrame  # the target's, in the user's unit
    reach: float  # correspondence distance of ICP, diameters
    limit: float  # error above which a registration counts as failed, diameters
    enactments: Sequence[Enactment] = ()  # most probable first
    truth: CauseSettings = field(default_factory=CauseSettings)  # their settings
    T_repaired: np.ndarray | None = None  # (4, 4) of the pose that takes the place of the result
    T_others: Sequence[np.ndarray] = ()  # poses to be shown where nothing was re-enacted

    @property
    def aligned(self) -> np.ndarray:
        """The registered source (N, 3)."""
        return transform(self.T_found, self.source)

    @cached_property
    def possibilities(self) -> tuple[Possibility, ...]:
        """Hypotheses of the true pose, most probable first; empty without a re-enactment."""
        if not self.enactments:
            return ()
        weight_k = weights_of(enactment.hypothesis for enactment in self.enactments)
        possibilities = []
        for enactment, weight in zip(self.enactments, weight_k, strict=True):
            candidate, registrar = enactment.candidate, Registrar(enactment.candidate, self.truth, misses=True)
            clouds = []
            for causes in SUBSETS:
                applied = tuple(cause for cause in causes if candidate.applied[cause])
                try:
                    T = registrar.run(applied, np.zeros((1, 6))).T_target_source_n[0]
                except Unmeasurable:
                    T = candidate.start(applied)
                clouds.append(transform(T, candidate.observed(applied)))
            T, errors = enactment.hypothesis.T, tuple(enactment.error_8)
            possibilities.append(Possibility(float(weight), T, errors, tuple(clouds)))
        return tuple(possibilities)

    def packed(self, unit: str) -> dict[str, object]:
        """JSON values for the page's script, see :func:`packed_pair`."""
        pair = packed_pair(self.target, self.source, self.T_found, self.reach, self.frame.diameter, unit)
        poses = [
            {"T": flat(pose.T), "what_ifs": [packed(pose.clouds[subset]) for subset in BY_SIZE]}
            for pose in self.possibilities
        ] or [{"T": flat(T), "what_ifs": []} for T in self.T_others]
        return pair | {"poses": poses} | self._compared()

    def _compared(self) -> dict[str, object]:
        if self.T_repaired is not None:
            return {"repaired": flat(self.T_repaired), "beside": "repaired"}
        T_poses = [pose.T for pose in self.possibilities] or self.T_others
        if not len(T_poses):
            return {}
        moved = transform(T_poses[0], self.source) - self.aligned
        return {"beside": "pose:0"} if np.linalg.norm(moved, axis=1).mean() > self.limit else {}


def packed_pair(
    target: np.ndarray, source: np.ndarray, T_found: np.ndarray, reach: float, diameter: float, unit: str
) -> dict[str, object]:
    """Return two clouds and a result as JSON values in diameters; from `reach` on, all points get one color."""
    radii = [np.linalg.norm(points, axis=1) for points in (target, transform(T_found, source))]
    radius = max(float(np.quantile(radius, 0.98)) for radius in radii)  # a few far points are ignored
    return {
        "unit": unit,
        "diameter": diameter,
        "reach": reach,
        "radius": float(np.clip(radius, 0.4, FARTHEST)),
        "target": packed(target),
        "source": packed(source),
        "found": flat(T_found),
    }


def packed(points: np.ndarray) -> dict[str, object]:
    """Return points (N, 3), evenly thinned to `MOST_POINTS`, as 16-bit multiples of a step in base64."""
    kept = points[np.linspace(0, len(points) - 1, min(len(points), MOST_POINTS)).astype(int)]
    step = max(float(np.abs(kept).max()), 1e-9) / LARGEST_STEP
    return {"step": step, "data": b64encode(np.rint(kept / step).astype("<i2").tobytes()).decode("ascii")}


def flat(T: np.ndarray) -> list[float]:
    return [float(f"{value:.7g}") for value in T.ravel()]


def taken_out(subset: int, without: Mapping[str, str] = WITHOUT) -> str:
    gone = [without[name] for cause, name in enumerate(CONCEPTS) if cause not in SUBSETS[subset]]
    return ", ".join(gone).capitalize() or "As it was"
