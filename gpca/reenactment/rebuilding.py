"""Clouds as they would have been: the observed one without noise, and with the surface that it misses."""

from __future__ import annotations

import numpy as np

from gpca.alignment.rigid import inverse
from gpca.causes.candidate import Candidate
from gpca.pairs.perturbation import CONCEPTS, NOISE, OVERLAP, POSE
from gpca.reenactment.observation import QUIET, Observation
from gpca.reenactment.surface import ModelSurface

FEW_OUTLIERS = 0.01  # share of the points; fewer are none
MOST_ADDED = 1024  # points
BESIDE = 0.6  # of the spacing: so far from a model's point, in its plane, a fresh point may lie


def rebuild(T: np.ndarray, observation: Observation, surface: ModelSurface, random: np.random.Generator) -> Candidate:
    """Return the pair as a candidate of the truth: what was observed is its noisy cloud, of which a part is kept.

    Noise is taken away by moving each point to its plane, as far as the noise exceeds the roughness of the planes;
    outliers become fresh points. Missing surface is filled with fresh points, as dense as the rest and as noisy.

    Args:
        T: 4×4, the hypothesis: takes what was observed to the model.
    """
    noise, missing = observation.noise, observation.missing
    quiet = noise <= QUIET and observation.outliers < FEW_OUTLIERS
    clean = observation.points
    covered, absent = np.flatnonzero(observation.covered), np.flatnonzero(~observation.covered)
    if not quiet:
        if noise > QUIET:
            moved = noise**2 / (noise**2 + surface.roughness) * observation.residuals
            clean = clean - moved[:, None] * surface.normals[observation.rows]
        fresh = fresh_points(surface, covered, len(clean), random)
        clean = np.where(observation.is_outlier[:, None], fresh, clean)
    count = min(MOST_ADDED, round(len(clean) * missing / (1 - missing)))
    added = fresh_points(surface, absent, count, random) if count else np.empty((0, 3))
    jitter, anywhere = random.normal(size=added.shape), random.uniform(-0.5, 0.5, size=added.shape)
    scattered = random.random(count) < observation.outliers
    noisy = np.where(scattered[:, None] & (not quiet), anywhere, added + (noise > QUIET) * noise * jitter)
    applied = np.zeros(len(CONCEPTS), bool)
    applied[NOISE], applied[POSE], applied[OVERLAP] = not quiet, True, count > 0
    return Candidate(
        applied=applied,
        model=surface.points,
        clean=np.concatenate([clean, added]),
        noisy=np.concatenate([observation.points, noisy]),
        seen=np.arange(len(clean) + count),
        kept=np.arange(len(clean)),
        T_near=np.eye(4),
        T_init=inverse(T),
        severity={"noise": noise, "outliers": observation.outliers, "crop": missing},
    )


def fresh_points(surface: ModelSurface, rows: np.ndarray, count: int, random: np.random.Generator) -> np.ndarray:
    """Return points (count, 3) of the surface around some of the model's points."""
    chosen = random.choice(rows, size=count, replace=count > len(rows))
    beside = random.uniform(-BESIDE, BESIDE, size=(count, 2, 1)) * surface.spacing_M[chosen, None, None]
    return surface.points[chosen] + (beside * surface.tangents[chosen]).sum(axis=1)
