"""Distances within a pair after ICP, and the local shape of its clouds: quantiles over the points.

The first four groups of thirteen are the plainest that tell a registration's faults apart: how far the observed cloud
lies from the model, the model from the observed cloud, the observed cloud from the model's local planes, and how thick
the observed cloud is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from gpca.features.pair import ObservedPair

if TYPE_CHECKING:
    from gpca.features.pair import ObservedPair

QUANTILES = np.array([0.01, *np.arange(1, 12) / 12, 0.99])  # the very ends belong to single points
NEIGHBORS = 12  # so many span a local plane
CHANNELS = 7
LEAST = 0.02  # of the model's spacing, to which lengths are raised: a flat face is not infinitely thin


@dataclass(frozen=True)
class LocalPlanes:
    """A cloud with the plane around each of its points.

    Attributes:
        tree: of the points.
        spacing: (N,) distance to the nearest other point.
        normals: (N, 3), without a sign.
        thickness, extent: (N,) root mean square distance of the neighbors from the plane, and along its longest axis.
    """

    tree: cKDTree
    spacing: np.ndarray
    normals: np.ndarray
    thickness: np.ndarray
    extent: np.ndarray

    @classmethod
    def of(cls, points: np.ndarray) -> LocalPlanes:
        """Return the planes of least squares through the nearest points of each point (N, 3)."""
        tree = cKDTree(points)
        neighbors = min(NEIGHBORS, len(points))
        distances_N_k, rows_N_k = tree.query(points, neighbors)
        around_N_k_3 = points[rows_N_k]
        offsets_N_k_3 = around_N_k_3 - around_N_k_3.mean(axis=1, keepdims=True)
        squares_N_3, axes_N_3_3 = np.linalg.eigh(second_moments(offsets_N_k_3))
        spread_N_3 = np.sqrt(np.maximum(squares_N_3, 0) / neighbors)
        return cls(tree, distances_N_k[:, 1], axes_N_3_3[:, :, 0], spread_N_3[:, 0], spread_N_3[:, 2])


def second_moments(offsets_N_k_3: np.ndarray) -> np.ndarray:
    """Return Σ x xᵀ (N, 3, 3), summed in one order on every processor."""
    x, y, z = np.moveaxis(offsets_N_k_3, -1, 0)
    rows = [[(a * b).sum(axis=1) for b in (x, y, z)] for a in (x, y, z)]
    return np.moveaxis(np.array(rows), -1, 0)


def _dots(a_N_3: np.ndarray, b_N_3: np.ndarray) -> np.ndarray:
    return a_N_3[:, 0] * b_N_3[:, 0] + a_N_3[:, 1] * b_N_3[:, 1] + a_N_3[:, 2] * b_N_3[:, 2]


@dataclass(frozen=True)
class MatchedPair:
    """A pair whose points know their partners: the nearest points of the other cloud.

    Attributes:
        observed, model: the local planes of either cloud.
        partner_N, partner_M: row of each point's partner in the other cloud.
        to_model_N, to_observed_M: the distance there.
        plane_N, plane_M: the distance from the partner's plane.
        cosine_N: |cosine| between the normals of an observed point and its partner.
    """

    observed: LocalPlanes
    model: LocalPlanes
    partner_N: np.ndarray
    partner_M: np.ndarray
    to_model_N: np.ndarray
    to_observed_M: np.ndarray
    plane_N: np.ndarray
    plane_M: np.ndarray
    cosine_N: np.ndarray

    @classmethod
    def of(cls, pair: ObservedPair) -> MatchedPair:
        """Find planes and partners of a pair."""
        observed, model = LocalPlanes.of(pair.observed), LocalPlanes.of(pair.model)
        to_model_N, partner_N = model.tree.query(pair.observed)
        to_observed_M, partner_M = observed.tree.query(pair.model)
        return cls(
            *(observed, model, partner_N, partner_M, to_model_N, to_observed_M),
            plane_N=np.abs(_dots(pair.observed - pair.model[partner_N], model.normals[partner_N])),
            plane_M=np.abs(_dots(pair.model - pair.observed[partner_M], observed.normals[partner_M])),
            cosine_N=np.abs(_dots(observed.normals, model.normals[partner_N])),
        )

    @property
    def cosine_M(self) -> np.ndarray:
        """|cosine| (M,) between the normals of a point of the model and its partner."""
        return np.abs(_dots(self.model.normals, self.observed.normals[self.partner_M]))


def describe_distances(pair: ObservedPair, matched: MatchedPair | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return the 52 distances of the pair, and 45 further numbers of its local planes.

    The second are quantiles of the model's distance from the observed cloud's planes, of |cosine| between the normals
    of partners, and of the model's thickness; the median spacings and extents of both; and the logarithms of their
    numbers of points.
    """
    matched = matched or MatchedPair.of(pair)
    observed, model = matched.observed, matched.model
    spacings = [np.median(planes.spacing) for planes in (observed, model)]
    extents = [np.median(planes.extent) for planes in (observed, model)]
    counts = [np.log(len(cloud)) for cloud in (pair.observed, pair.model)]
    distances = [matched.to_model_N, matched.to_observed_M, matched.plane_N, observed.thickness]
    shapes = [matched.plane_M, matched.cosine_N, model.thickness]
    return (
        np.concatenate([np.quantile(values, QUANTILES) for values in distances]),
        np.concatenate([*(np.quantile(values, QUANTILES) for values in shapes), spacings, extents, counts]),
    )


def describe_points(pair: ObservedPair, matched: MatchedPair, points: int) -> np.ndarray:
    """Return (2, points, `CHANNELS`) float32, of the observed cloud and of the model.

    Coordinates (diameters); logarithms of the distance to the nearest point of the other cloud, relative to the spacing
    of the model, of the distance from that point's local plane, relative to the model's usual thickness, and of the own
    thickness relative to that point's; |cosine| between the normals. Clouds of fewer points repeat some.
    """
    spacing = float(np.median(matched.model.spacing))
    usual_thickness = float(np.median(matched.model.thickness))
    observed, model = matched.observed, matched.model

    def log_ratio(lengths: np.ndarray, to: np.ndarray | float) -> np.ndarray:
        return log_of_ratio(lengths, to, spacing)

    of_observed = (
        log_ratio(matched.to_model_N, spacing),
        log_ratio(matched.plane_N, usual_thickness),
        log_ratio(observed.thickness, model.thickness[matched.partner_N]),
        matched.cosine_N,
    )
    of_model = (
        log_ratio(matched.to_observed_M, spacing),
        log_ratio(matched.plane_M, usual_thickness),
        log_ratio(model.thickness, observed.thickness[matched.partner_M]),
        matched.cosine_M,
    )
    sides = (np.column_stack([pair.observed, *of_observed]), np.column_stack([pair.model, *of_model]))
    return np.stack([side[np.arange(points) % len(side)] for side in sides]).astype(np.float32)


def log_of_ratio(lengths: np.ndarray, to: np.ndarray | float, spacing: float) -> np.ndarray:
    """Return the logarithm of a ratio of lengths, none of which counts as less than `LEAST` of the model's spacing."""
    return np.log(np.maximum(lengths, LEAST * spacing)) - np.log(np.maximum(to, LEAST * spacing))
