"""Candidates: a model and an observed cloud, with any subset of the causes.

All lengths are relative to the object's diameter. The observed cloud is kept in the model's frame, in which the true
pose is the identity; a pose error is where the registration starts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gpca.alignment.rigid import random_direction
from gpca.causes.settings import FEWEST_POINTS, CauseSettings
from gpca.pairs.perturbation import CONCEPTS, NOISE, OVERLAP, POSE, misplacement, within_half_space


def draw_applied(settings: CauseSettings, random: np.random.Generator) -> np.ndarray:
    """Return which of the causes (3,) are applied."""
    return random.random(len(CONCEPTS)) < settings.present


@dataclass(frozen=True)
class Candidate:
    """A pair and all causes that may be applied to it.

    Attributes:
        applied: (3,) which of noise, pose and overlap are.
        model: (P, 3) points of the model.
        clean, noisy: (Q, 3) other points of the surface, and the same with jitter and outliers.
        kept: (K,) rows of them that an occlusion leaves.
        T_init: 4×4, where a pose error starts: takes what was observed to a wrong place in the model's frame.
        severity: by name, 0 where not applied.
        model_at_truth: (P, 3) the model where no pose error is, if it is rendered where the registration starts; None
            where it is the same everywhere.
        toward_hidden: (3,) unit vector along which the surface was cut off; None where no half-space has cut it.
    """

    applied: np.ndarray
    model: np.ndarray
    clean: np.ndarray
    noisy: np.ndarray
    kept: np.ndarray
    T_init: np.ndarray
    severity: dict[str, float]
    model_at_truth: np.ndarray | None = None
    toward_hidden: np.ndarray | None = None

    def observed(self, causes: tuple[int, ...]) -> np.ndarray:
        """Return the observed cloud with these of the applied causes."""
        points = self.noisy if NOISE in causes else self.clean
        return points[self.kept] if OVERLAP in causes else points

    def reference(self, causes: tuple[int, ...]) -> np.ndarray:
        """Return the model's points that a registration with these of the applied causes is given."""
        return self.model if POSE in causes or self.model_at_truth is None else self.model_at_truth

    def start(self, causes: tuple[int, ...]) -> np.ndarray:
        """Return the pose, 4×4, that a registration with these of the applied causes starts from."""
        return self.T_init if POSE in causes else np.eye(4)


def draw_candidate(
    surface: np.ndarray, applied: np.ndarray, settings: CauseSettings, random: np.random.Generator
) -> Candidate:
    """Draw the points and the severities of a candidate.

    Args:
        surface: (N, 3) points of the object, of which model and observation take different ones.
        applied: (3,) of :func:`draw_applied`.
    """
    ranges, (fewest, most) = settings.severities, settings.points
    counts = np.exp(random.uniform(np.log(fewest), np.log(most), size=2)).round().astype(int)
    n_model, n_observed = np.minimum(counts, len(surface) // 2)
    order = random.permutation(len(surface))
    model, clean = surface[order[:n_model]], surface[order[n_model : n_model + n_observed]]
    severity = {
        "noise": random.uniform(*ranges.noise),
        "outliers": random.uniform(*ranges.outliers),
        "rotation_rad": float(np.deg2rad(random.uniform(*ranges.rotation_deg))),
        "translation": random.uniform(*ranges.translation),
        "crop": random.uniform(*ranges.crop),
    }
    jitter = random.normal(scale=severity["noise"], size=clean.shape)
    anywhere = random.uniform(-0.5, 0.5, size=clean.shape)
    is_outlier = random.random(len(clean)) < severity["outliers"]
    toward_hidden = random_direction(random)
    along = (clean * toward_hidden).sum(axis=1)
    cause_of = {"noise": NOISE, "outliers": NOISE, "rotation_rad": POSE, "translation": POSE, "crop": OVERLAP}
    return Candidate(
        applied=applied,
        model=model,
        clean=clean,
        noisy=np.where(is_outlier[:, None], anywhere, clean + jitter),
        kept=within_half_space(along, severity["crop"], FEWEST_POINTS),
        T_init=misplacement(severity["rotation_rad"], severity["translation"], random),
        severity={name: value if applied[cause_of[name]] else 0.0 for name, value in severity.items()},
        toward_hidden=toward_hidden,
    )
