"""Surface splatting: points drawn as overlapping discs in their tangent planes (Zwicker et al., SIGGRAPH 2001)."""

from __future__ import annotations

import math

import numpy as np

from gpca.process.compilation import njit

AWAY = 0.7  # Discs that face away are this much smaller, lest the far wall stand out over a rim.
BLEND = 1.5  # Discs within this many radii of the nearest are one surface: their normals are averaged.
CROWN = 1.5  # A disc's rim lies this many radii below its middle, so that a face's own discs win at its edge.
LEAST_TILT = 0.12  # Discs seen edge on are kept this wide.


def splat(positions: np.ndarray, facing: np.ndarray, radius: float, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Draw every point as a disc: one pass finds the nearest depth of each pixel, another averages the discs there.

    Args:
        positions: The points (P, 3) in pixels: right, up, and towards the eye.
        facing: Their unit normals (P, 3) along these axes.
        radius: That of the discs, in pixels; every point lies at least so far inside the picture.
        size: The width and the height of the picture.

    Returns:
        The depth (size, size), NaN where bare, and the summed normals (size, size, 3) of what is seen.
    """
    from scipy.ndimage import minimum_filter

    nearest = np.full((size, size), -np.inf)
    _keep_nearest(positions, facing, radius, nearest)
    # A disc that lies behind everything around it adds to no pixel and is left out.
    behind = minimum_filter(nearest, 2 * math.ceil(radius) + 1)
    column, row = np.floor(positions[:, :2].T).astype(np.int64)
    kept = positions[:, 2] + (1 + BLEND) * radius > behind[row, column]
    sums = np.zeros((size, size, 5))  # weight, weighted height and weighted normal
    _add_seen(positions[kept], facing[kept], radius, nearest, sums)
    weights = sums[..., 0]
    depth = np.divide(sums[..., 1], weights, out=np.full((size, size), np.nan), where=weights > 0)
    return depth, sums[..., 2:]


@njit(cache=True)
def _keep_nearest(positions, facing, radius, nearest):
    """Raise the depths `nearest` (size, size) to those of the discs, which lie lower towards their rims."""
    reach = math.floor(radius)
    for n in range(len(positions)):
        column, row = math.floor(positions[n, 0]), math.floor(positions[n, 1])
        for up in range(-reach, reach + 1):
            for right in range(-reach, reach + 1):
                height, crown, distance2 = _disc(positions[n, 2], facing[n], right, up, radius)
                if distance2 <= 1:
                    pixel = row + up, column + right
                    nearest[pixel] = max(nearest[pixel], height - crown)


@njit(cache=True)
def _add_seen(positions, facing, radius, nearest, sums):
    """Add to the sums (size, size, 5) the discs that lie within `BLEND` radii of the nearest."""
    reach = math.floor(radius)
    for n in range(len(positions)):
        column, row = math.floor(positions[n, 0]), math.floor(positions[n, 1])
        away = facing[n, 2] < 0
        for up in range(-reach, reach + 1):
            for right in range(-reach, reach + 1):
                height, crown, distance2 = _disc(positions[n, 2], facing[n], right, up, radius)
                pixel = row + up, column + right
                if distance2 <= 1 and height - crown > nearest[pixel] - BLEND * radius:
                    weight = math.exp(-3 * distance2) * (0.01 if away else 1.0)
                    total = sums[pixel]
                    total[0] += weight
                    total[1] += weight * height
                    for axis in range(3):
                        total[2 + axis] += weight * (-facing[n, axis] if away else facing[n, axis])


@njit(cache=True)
def _disc(middle, normal, right, up, radius):
    """Return the height of a disc at an offset in pixels, what its rim loses of it there, and its share of the radius².

    Where the disc does not reach, that share is infinite.
    """
    away = normal[2] < 0
    slant = max(abs(normal[2]), LEAST_TILT) * (-1.0 if away else 1.0)
    rise = -(normal[0] * right + normal[1] * up) / slant
    distance2 = (right * right + up * up + rise * rise) / radius**2
    if distance2 > (AWAY**2 if away else 1.0):
        return 0.0, 0.0, math.inf
    return middle + rise, radius * (CROWN * distance2 + away), distance2
