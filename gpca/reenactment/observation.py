"""What a hypothesis says of the observation: its noise, its outliers, and which part of the surface it misses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gpca.alignment.rigid import transform
from gpca.reenactment.half_space import covered_points
from gpca.reenactment.hypotheses import Hypothesis
from gpca.reenactment.surface import ModelSurface, trimmed_square

NOISES = np.array([0.0, 0.01, 0.02, 0.03, 0.045, 0.06, 0.08, 0.11])  # diameters, that are simulated
SIMULATED = 512  # points, at least
FEWEST_INLIERS = 16
QUIET = 0.004  # diameters; noise that is no larger is none


class NoiseScale:
    """Tells noise from the distances of points to a model's planes, by noise that is simulated on the model itself.

    The nearest point of a noisy one is often not where it came from, so distances grow more slowly than the noise.
    """

    def __init__(self, surface: ModelSurface, random: np.random.Generator) -> None:
        repeats = max(1, -(-SIMULATED // len(surface.points)))
        points = np.tile(surface.points, (repeats, 1))
        unit = random.normal(size=points.shape)
        squares = [trimmed_square(surface.residuals(points + noise * unit)[0]) for noise in NOISES]
        roots = np.sqrt(np.array(squares) + surface.roughness)
        self._roots = np.maximum.accumulate(roots + 1e-9 * np.arange(len(roots)))

    def noise(self, residuals_N: np.ndarray) -> float:
        """Return the standard deviation per axis, in diameters, that makes distances from planes as large as these."""
        return float(np.interp(np.sqrt(trimmed_square(residuals_N)), self._roots, NOISES))


@dataclass(frozen=True)
class Observation:
    """The observed points (N, 3) where a hypothesis puts them in the model.

    Attributes:
        points: (N, 3).
        is_outlier: (N,).
        noise: standard deviation per axis, diameters.
        residuals, rows: (N,) signed distances from the plane of the nearest model point, and that point.
        covered: (M,) which points of the model were observed.
    """

    points: np.ndarray
    is_outlier: np.ndarray
    noise: float
    residuals: np.ndarray
    rows: np.ndarray
    covered: np.ndarray

    @property
    def outliers(self) -> float:
        """The share of the points that are outliers."""
        return float(self.is_outlier.mean())

    @property
    def missing(self) -> float:
        """The share of the model that was not observed."""
        return float(1 - self.covered.mean())


def observe(
    observed: np.ndarray,
    hypothesis: Hypothesis,
    surface: ModelSurface,
    scale: NoiseScale,
    random: np.random.Generator,
) -> Observation:
    """Return what a hypothesis says of the observed points (N, 3)."""
    points = transform(hypothesis.T, observed)
    is_outlier = hypothesis.inlier_N <= 0.5
    fewest = min(len(points), max(FEWEST_INLIERS, len(points) // 2))
    if (~is_outlier).sum() < FEWEST_INLIERS:
        is_outlier = np.ones(len(points), bool)
        is_outlier[np.argsort(-hypothesis.inlier_N, kind="stable")[:fewest]] = False
    residuals, rows = surface.residuals(points)
    noise = scale.noise(residuals[~is_outlier])
    covered = covered_points(surface.points, points[~is_outlier], noise, random)
    return Observation(points, is_outlier, noise, residuals, rows, covered)
