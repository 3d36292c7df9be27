"""Features of each point of a registered pair that relate it to the other cloud, for encoders of pairs."""

from __future__ import annotations

import numpy as np

from gpca.features.distances import MatchedPair
from gpca.features.pair import ObservedPair

CHANNELS = 7
LEAST = 0.02  # of the model's spacing, to which lengths are raised: a flat face is not infinitely thin


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
