"""Overlap lost to an occluder: the silhouette of another object moved over the mask, as if it stood in front."""

from __future__ import annotations

import numpy as np

from gpca.frames.instances import Instances

STEP_PX = 2
TOLERANCE = 0.03


def occlude(
    instances: Instances, i: int, pixels_P_2: np.ndarray, share: float, random: np.random.Generator
) -> np.ndarray | None:
    """Return which of the pixels stay visible (P,) when an occluder covers about the given share of them.

    Occluders are the visible silhouettes of the dataset's other objects at their own size, tried in random order. One
    comes in from a random direction until it covers the share.

    Args:
        pixels_P_2: (u, v) of the points of instance i that are in question.
        share: how much of the pixels is to be covered.

    Returns:
        None where no silhouette of the dataset can cover that share to within `TOLERANCE`.
    """
    others = np.flatnonzero(
        (instances.dataset == instances.dataset[i]) & (instances.object_index != instances.object_index[i])
    )
    center = pixels_P_2.mean(axis=0)
    for other in random.permutation(others):
        silhouette, corner = _silhouette(instances.pixels_of(other))
        angle = random.uniform(0, 2 * np.pi)
        direction = np.array([np.cos(angle), np.sin(angle)])
        reach = np.linalg.norm(np.ptp(pixels_P_2, axis=0)) + np.linalg.norm(silhouette.shape)
        start = center - corner - np.array(silhouette.shape[::-1]) / 2
        for distance_px in np.arange(reach, 0, -STEP_PX):
            covered_P = _covers(silhouette, pixels_P_2 - np.rint(corner + start + distance_px * direction).astype(int))
            if covered_P.mean() >= share:
                break
        if abs(covered_P.mean() - share) <= TOLERANCE:
            return ~covered_P
    return None


def _silhouette(pixels_P_2: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mask within its bounding box, closed where single pixels were not measured, and the box's corner."""
    from scipy.ndimage import binary_closing

    corner = pixels_P_2.min(axis=0)
    u, v = (pixels_P_2 - corner).T
    mask = np.zeros((v.max() + 1, u.max() + 1), bool)
    mask[v, u] = True
    return binary_closing(np.pad(mask, 3), iterations=2)[3:-3, 3:-3], corner


def _covers(silhouette: np.ndarray, pixels_P_2: np.ndarray) -> np.ndarray:
    height, width = silhouette.shape
    u, v = pixels_P_2.T
    inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
    return inside & silhouette[v.clip(0, height - 1), u.clip(0, width - 1)]
