"""Which part of a surface was observed: before a plane, what one side sees, or all but some patches."""

from __future__ import annotations

from functools import cache, cached_property

import numpy as np
from scipy.spatial import cKDTree

from gpca.causes.candidate import visible_rows

DIRECTIONS = 150
FEW, FEW_MODEL = 192, 256  # points of the observed cloud and of the model that are compared
OUTSIDE = 0.03  # of the observed points may lie outside
NATS = 6.0  # that each further part of a region has to gain
PATCHES = (0.06, 0.1, 0.15, 0.22, 0.3, 0.4, 0.5)  # shares in a patch
CENTERS, MOST_PATCHES = 64, 4
LEAST_LEFT = 0.12  # share of the model that was observed


class Regions:
    """The parts that may have been observed of a model (M, 3), whose points are in random order and have a spacing."""

    def __init__(self, model: np.ndarray, spacing: float) -> None:
        self._points = model[:FEW_MODEL]
        self._gap = spacing * np.sqrt(len(model) / len(self._points)) / 2
        self._near_M = cKDTree(self._points).query(model)[1]
        self._whole = np.ones((len(self._points), 1), bool)

    @cached_property
    def _sides(self) -> np.ndarray:
        seen = [visible_rows(self._points, toward) for toward in directions()[::5]]
        return np.stack([np.isin(np.arange(len(self._points)), rows) for rows in seen], axis=1)

    @cached_property
    def _patches(self) -> np.ndarray:
        distance = np.linalg.norm(self._points[:, None] - self._points[:CENTERS], axis=2)
        reach = np.sort(distance, axis=0)
        return np.concatenate([distance <= reach[int(share * len(distance))] for share in PATCHES], axis=1)

    def likeliest(self, covered_M: np.ndarray, points: np.ndarray, noise: float) -> np.ndarray:
        """Return which points (M,) of the model were observed: the given ones unless another region explains more."""
        few = points[np.linspace(0, len(points) - 1, min(FEW, len(points))).astype(int)]
        square_N_m = np.square(few[:, None] - self._points).sum(axis=2)
        weight_N_m = np.exp(-0.5 * (square_N_m - square_N_m.min(axis=1, keepdims=True)) / (noise**2 + self._gap**2))
        weight_N_m /= weight_N_m.sum(axis=1, keepdims=True)

        def best_of(regions: np.ndarray) -> tuple[float, np.ndarray]:
            """Return by how many nats the likeliest of some regions (m, R) explains more than the whole, and which."""
            # A region of a share s is 1/s times as likely for each observed point inside, and hardly for any outside.
            share_R = np.maximum(regions.mean(axis=0), LEAST_LEFT)
            inside_N_R = weight_N_m @ regions.astype(float)
            nats_R = np.log((1 - OUTSIDE) * inside_N_R / share_R + OUTSIDE).sum(axis=0)
            return float(nats_R.max()), regions[:, nats_R.argmax()]

        before_plane = best_of(covered_M[: len(self._points), None])[0] - NATS
        most, region = best_of(self._sides)
        most -= NATS
        nats, left = 0.0, np.ones((len(self._points), 1), bool)
        for count in range(1, MOST_PATCHES + 1):
            gained, further = best_of(left & ~self._patches)
            if gained - NATS <= nats:
                break
            nats, left = gained, further[:, None]
            if nats - count * NATS > most:
                most, region = nats - count * NATS, further
        return region[self._near_M] if most > max(before_plane, 0.0) else covered_M


@cache
def directions() -> np.ndarray:
    """Return unit vectors (K, 3) spread evenly over the sphere (a spiral of Fibonacci)."""
    i = np.arange(DIRECTIONS) + 0.5
    z, turn = 1 - 2 * i / DIRECTIONS, np.pi * (1 + 5**0.5) * i
    across = np.sqrt(1 - z * z)
    return np.column_stack([np.cos(turn) * across, np.sin(turn) * across, z])
