"""Farthest-point sampling and the ball query behind :mod:`gpca.encoders.grouping`, compiled by numba.

All coordinates are C-contiguous float32. Clouds run in parallel on the threads that numba is given;
each is worked on by one thread alone, so the thread count changes no bit. Inner loops run over points, where they
vectorize.
"""

from __future__ import annotations

import numpy as np

from gpca.process.compilation import OVER_CLOUDS, njit, prange


@njit(**OVER_CLOUDS)
def farthest_points(points, n_centers):
    """Return (B, M): point 0, then always the point farthest from all chosen ones, ties to the lower index."""
    batch, n, _ = points.shape
    chosen = np.zeros((batch, n_centers), np.int32)
    for b in prange(batch):
        x, y, z = points[b, :, 0].copy(), points[b, :, 1].copy(), points[b, :, 2].copy()
        nearest = np.full(n, np.inf, points.dtype)  # squared distance to the nearest chosen point
        last = 0
        for m in range(1, n_centers):
            farthest = points.dtype.type(-1)
            for i in range(n):
                dx, dy, dz = x[i] - x[last], y[i] - y[last], z[i] - z[last]
                nearest[i] = min(nearest[i], dx * dx + dy * dy + dz * dz)
                farthest = max(farthest, nearest[i])
            last = 0
            while last < n - 1 and nearest[last] != farthest:
                last += 1
            chosen[b, m] = last
    return chosen


@njit(**OVER_CLOUDS)
def ball_query(points, centers, radius, k):
    """Return neighbors (B, M, k) and counts (B, M); see :func:`gpca.encoders.grouping.ball_query`."""
    batch, n, _ = points.shape
    n_centers = centers.shape[1]
    # np.empty will not do: a center of NaN has no neighbor at all, and the slots must still be indices of points.
    neighbors = np.zeros((batch, n_centers, k), np.int32)
    counts = np.zeros((batch, n_centers), np.int32)
    limit = points.dtype.type(radius) * points.dtype.type(radius)
    for b in prange(batch):
        x, y, z = points[b, :, 0].copy(), points[b, :, 1].copy(), points[b, :, 2].copy()
        squares = np.empty(n, points.dtype)
        for m in range(n_centers):
            cx, cy, cz = centers[b, m, 0], centers[b, m, 1], centers[b, m, 2]
            for i in range(n):
                dx, dy, dz = x[i] - cx, y[i] - cy, z[i] - cz
                squares[i] = dx * dx + dy * dy + dz * dz
            listed = neighbors[b, m]
            count = 0
            for i in range(n):
                # Written always, kept only when within: no branch to mispredict.
                listed[count] = i
                count += squares[i] <= limit
                if count == k:
                    break
            listed[count:] = listed[0] if count else 0
            counts[b, m] = max(count, 1)
    return neighbors, counts
