"""Alignment quality by entropy: is the joint cloud as crisp as the two apart? (CorAl, Adolfsson et al. 2021.)

The entropy of a point is that of a normal distribution with its neighbors' covariance, ½ ln |2πe Σ| at a given radius.
Where two clouds lie on each other, points have about the same entropy in the joint cloud as in their own; where they
do not, joining them blurs it.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from gpca.features.pair import ObservedPair

RADII = (0.06, 0.12)  # diameters: about the spacing of the sparsest clouds, and twice that
FEWEST_NEIGHBORS = 4  # without so many a covariance in space is singular
FLOOR = 1e-6  # squared diameters; a plane has no entropy otherwise
ENTROPY = tuple(f"{what}_{radius:g}" for radius in RADII for what in ("joint", "apart", "difference", "measured"))


def describe_entropy(pair: ObservedPair) -> np.ndarray:
    """Return `ENTROPY`.

    At each radius the mean entropy (nats) of the points joint and apart, their difference, and the share of the points
    that have enough neighbors for it.
    """
    joint = np.concatenate([pair.observed, pair.model])
    described: list[float] = []
    for radius in RADII:
        own_N = np.concatenate([_entropies(cloud, radius) for cloud in (pair.observed, pair.model)])
        joint_N = _entropies(joint, radius)
        measured_N = np.isfinite(own_N)
        if not measured_N.any():
            described += [0.0, 0.0, 0.0, 0.0]
            continue
        means = joint_N[measured_N].mean(), own_N[measured_N].mean()
        described += [*means, means[0] - means[1], measured_N.mean()]
    return np.array(described)


def _entropies(points: np.ndarray, radius: float) -> np.ndarray:
    """Return ½ ln |2πe (Σ + εI)| (N,) of the points within a radius of each; NaN where there are too few."""
    pairs = cKDTree(points).query_pairs(radius, output_type="ndarray")
    itself = np.arange(len(points))
    rows, columns = (np.concatenate([pairs[:, i], pairs[:, 1 - i], itself]) for i in (0, 1))
    count_N = np.bincount(rows, minlength=len(points)).astype(float)
    sums_N_3 = [np.bincount(rows, points[columns, i], len(points)) for i in range(3)]
    offset_P_3 = points[columns] - (np.column_stack(sums_N_3) / count_N[:, None])[rows]
    moments_N_3_3 = np.empty((len(points), 3, 3))
    for i, j in np.ndindex(3, 3):
        moments_N_3_3[:, i, j] = np.bincount(rows, offset_P_3[:, i] * offset_P_3[:, j], len(points)) / count_N
    enough_N = count_N >= FEWEST_NEIGHBORS
    entropy_N = np.full(len(points), np.nan)
    determinants = np.linalg.slogdet(2 * np.pi * np.e * (moments_N_3_3[enough_N] + FLOOR * np.eye(3)))[1]
    entropy_N[enough_N] = 0.5 * determinants
    return entropy_N
