"""Candidates: a model and an observed cloud, with any subset of the causes.

A cause that is not there is small, not zero: a start is never perfect, a sensor never without noise, a surface never
whole. Without this, any trace of a cause would give away that it was applied.

All lengths are relative to the object's diameter. The observed cloud is kept in the model's frame, in which the true
pose is the identity; a pose error is where the registration starts.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from gpca.alignment.rigid import random_direction
from gpca.causes.settings import FEWEST_POINTS, CauseSettings, CauseSeverities
from gpca.pairs.perturbation import CONCEPTS, NOISE, OVERLAP, POSE, displacement, within_half_space

CAUSE_OF = {"noise": NOISE, "outliers": NOISE, "rotation_rad": POSE, "translation": POSE, "crop": OVERLAP}


def draw_applied(settings: CauseSettings, random: np.random.Generator) -> np.ndarray:
    """Return which of the causes (3,) are applied."""
    return random.random(len(CONCEPTS)) < settings.present


@dataclass(frozen=True)
class Candidate:
    """A pair and all causes that may be applied to it.

    Attributes:
        applied: (3,) which of noise, pose and overlap are.
        model: (P, 3) points of the model.
        clean, noisy: (Q, 3) other points of the surface with a sensor's least noise, and with jitter and outliers.
        seen, kept: rows of them that a small gap leaves, and those that an occlusion leaves.
        T_near, T_init: 4×4, where a good start is, and where a pose error starts: they take what was observed to a
            wrong place in the model's frame.
        severity: by name; small where not applied.
        model_at_truth: (P, 3) the model where no pose error is, if it is rendered where the registration starts; None
            where it is the same everywhere.
        toward_hidden: (3,) unit vector along which the surface was cut off; None where no half-space has cut it.
    """

    applied: np.ndarray
    model: np.ndarray
    clean: np.ndarray
    noisy: np.ndarray
    seen: np.ndarray
    kept: np.ndarray
    T_near: np.ndarray
    T_init: np.ndarray
    severity: dict[str, float]
    model_at_truth: np.ndarray | None = None
    toward_hidden: np.ndarray | None = None

    def observed(self, causes: tuple[int, ...]) -> np.ndarray:
        """Return the observed cloud with these of the applied causes."""
        points = self.noisy if NOISE in causes else self.clean
        return points[self.kept if OVERLAP in causes else self.seen]

    def reference(self, causes: tuple[int, ...]) -> np.ndarray:
        """Return the model's points that a registration with these of the applied causes is given."""
        return self.model if POSE in causes or self.model_at_truth is None else self.model_at_truth

    def changing_reference(self, causes: tuple[int, ...]) -> tuple[int, ...]:
        """Return those of the causes that change :meth:`reference`: where they are the same, so are its points."""
        return () if self.model_at_truth is None else tuple(cause for cause in causes if cause == POSE)

    def start(self, causes: tuple[int, ...]) -> np.ndarray:
        """Return the pose, 4×4, that a registration with these of the applied causes starts from."""
        return self.T_init if POSE in causes else self.T_near


def draw_candidate(
    surface: np.ndarray, applied: np.ndarray, settings: CauseSettings, random: np.random.Generator
) -> Candidate:
    """Draw the points and the severities of a candidate.

    What is small where a cause is not applied is the same perturbation with a smaller severity: along the same axes,
    away from the same side. The number of points is that of what remains, so that it tells nothing about the surface
    that is missing.

    Args:
        surface: (N, 3) points of the object, of which model and observation take different ones.
        applied: (3,) of :func:`draw_applied`.
    """
    fewest, most = settings.points
    counts = np.exp(random.uniform(np.log(fewest), np.log(most), size=2)).round().astype(int)
    strong, small = (_severities(ranges, random) for ranges in (settings.severities, settings.small.ranges()))
    severity = {name: (strong if applied[cause] else small)[name] for name, cause in CAUSE_OF.items()}
    n_model, n_seen = np.minimum(counts, len(surface) // 2)
    n_observed = min(round(n_seen / (1 - severity["crop"])), len(surface) - n_model)
    order = random.permutation(len(surface))
    model, points = surface[order[:n_model]], surface[order[n_model : n_model + n_observed]]
    jitter = random.normal(size=points.shape)
    anywhere = random.uniform(-0.5, 0.5, size=points.shape)
    is_outlier = random.random(len(points)) < strong["outliers"]
    toward_hidden = random_direction(random)
    along = points @ toward_hidden
    axis, direction = random_direction(random), random_direction(random)
    seen, kept = (within_half_space(along, level["crop"], FEWEST_POINTS) for level in (small, strong))
    T_near, T_init = (
        displacement(level["rotation_rad"] * axis, level["translation"] * direction) for level in (small, strong)
    )
    return Candidate(
        applied=applied,
        model=model,
        clean=points + small["noise"] * jitter,
        noisy=np.where(is_outlier[:, None], anywhere, points + strong["noise"] * jitter),
        seen=seen,
        kept=kept,
        T_near=T_near,
        T_init=T_init,
        severity=severity,
        toward_hidden=toward_hidden,
    )


def redrawn(candidate: Candidate, surface: np.ndarray, random: np.random.Generator) -> Candidate:
    """Return a candidate without causes once more: as many other points, with the same severities and start."""
    rows = random.permutation(len(surface))[: len(candidate.model) + len(candidate.clean)]
    model, points = np.split(surface[rows], [len(candidate.model)])
    clean = points + candidate.severity["noise"] * random.normal(size=points.shape)
    seen = within_half_space(points @ candidate.toward_hidden, candidate.severity["crop"], FEWEST_POINTS)
    return replace(candidate, model=model, clean=clean, seen=seen)


def _severities(ranges: CauseSeverities, random: np.random.Generator) -> dict[str, float]:
    drawn = {part.name: random.uniform(*getattr(ranges, part.name)) for part in fields(ranges)}
    return drawn | {"rotation_rad": float(np.deg2rad(drawn.pop("rotation_deg")))}
