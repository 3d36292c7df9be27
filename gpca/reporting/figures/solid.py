"""Draws points with normals as a shaded solid, and a cloud over it.

The solid is its points as overlapping discs in their tangent planes (surface splatting, Zwicker et al., SIGGRAPH 2001).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gpca.process.compilation import njit
from gpca.reporting.figures.style import SOURCE_COLOR

BASE_COLOR, NEUTRAL = np.array([0.62, 0.70, 0.80]), np.array([0.80, 0.78, 0.74])  # of a solid, and of one with points
LIGHT = np.array([-0.42, 0.55, 0.72])  # The light shines over the left shoulder (right, up, towards the eye).
SUPERSAMPLING = 2  # The picture is drawn this much finer and averaged, which smooths outlines.
FILL = 0.9  # The larger side of an object's outline takes this share of its tile.
DISC_COVER = 12.0  # This many points lie under a disc on average, so exp(-12) of the surface stays bare.
LARGEST_DISC = 0.03  # No disc is larger than this share of the picture, so that a sparse cloud looks sparse.
OUTLINE = 0.6  # A pixel is solid where this share around it is; above 1/2, that draws the outline in.
AWAY = 0.7  # Discs that face away are this much smaller, lest the far wall stand out over a rim.
BLEND = 1.5  # Discs within this many radii of the nearest are one surface: their normals are averaged.
CROWN = 1.5  # A disc's rim lies this many radii below its middle, so that a face's own discs win at its edge.
LEAST_TILT = 0.12  # Discs seen edge on are kept this wide.
BEHIND = 0.03  # A point this share of the picture behind the solid is hidden by it.
HIDDEN_ALPHA = 0.25  # opacity of points that the solid hides


@dataclass(frozen=True)
class Solid:
    """A shaded solid in orthographic projection, in a view that goes right, up and towards the eye."""

    image: np.ndarray  # (pixels, pixels, 3) in [0, 1], row 0 on top, white where nothing is
    extent: tuple[float, float, float, float]  # left, right, bottom and top of the image, in the view
    depth: np.ndarray  # (size, size) towards the eye, row 0 at the bottom, NaN where nothing is
    axes: np.ndarray  # (3, 3) rotation to the view

    @classmethod
    def of(
        cls, points: np.ndarray, normals: np.ndarray, axes: np.ndarray, pixels: int, color: np.ndarray = BASE_COLOR
    ) -> Solid:
        """Render points (P, 3) with outward unit normals, seen along `axes`.

        Every point is a disc (:func:`splat`); normals that face away are turned towards the eye, as the back of a wall.
        The shading is done once per pixel: Lambert with a soft terminator, darkened where the depth buffer dips behind
        its surroundings (Luft et al., "Image enhancement by unsharp masking the depth buffer", SIGGRAPH 2006).
        """
        from scipy.spatial import cKDTree

        size = pixels * SUPERSAMPLING
        positions, facing = points @ axes.T, normals @ axes.T
        low, high = positions.min(axis=0), positions.max(axis=0)
        middle = (low + high) / 2
        scale = FILL * size / (float((high - low)[:2].max()) or 1.0)
        positions = (positions - middle) * scale
        positions[:, :2] += size / 2
        radius, neighbors = 1.0, min(8, len(positions) - 1)
        if neighbors:  # discs that cover DISC_COVER points, by the distance to the 8th neighbor
            distance, _ = cKDTree(positions).query(positions, k=[neighbors + 1])
            radius = max(1.0, float(np.median(distance)) * math.sqrt(DISC_COVER / neighbors))
        radius = min(radius, LARGEST_DISC * size)
        depth, normal = splat(positions, facing, radius, size)
        image = _shade(depth, normal, relief=size / 40, radius=radius, color=color)
        image = image.reshape(pixels, SUPERSAMPLING, pixels, SUPERSAMPLING, 3).mean(axis=(1, 3))[::-1]
        half = size / 2 / scale
        extent = middle[0] - half, middle[0] + half, middle[1] - half, middle[1] + half
        return cls(image, extent, depth / scale + middle[2], axes)

    def hides(self, seen_P_3: np.ndarray) -> np.ndarray:
        """Mask (P,) of points of the view that lie behind the solid by more than its points are apart."""
        left, right, bottom, _ = self.extent
        pixel_P_2 = np.floor((seen_P_3[:, :2] - (left, bottom)) * len(self.depth) / (right - left)).astype(int)
        inside_P: np.ndarray = np.all((pixel_P_2 >= 0) & (pixel_P_2 < len(self.depth)), axis=1)
        column_P, row_P = np.where(inside_P[:, None], pixel_P_2, 0).T
        return inside_P & (seen_P_3[:, 2] < self.depth[row_P, column_P] - BEHIND * (right - left))

    def draw(self, panel, cloud_P_3: np.ndarray, size: float, corners: np.ndarray, color: str = SOURCE_COLOR) -> None:
        """Draw the solid and a cloud over it, pale where the solid hides it; corners (2, 2) bound x and y."""
        seen_P_3 = cloud_P_3 @ self.axes.T
        hidden_P = self.hides(seen_P_3)
        panel.imshow(self.image, extent=self.extent, interpolation="antialiased")
        for rows, alpha in ((hidden_P, HIDDEN_ALPHA), (~hidden_P, 1.0)):
            panel.scatter(*seen_P_3[rows, :2].T, s=size, color=color, alpha=alpha, linewidths=0)
        panel.set(xlim=corners[0], ylim=corners[1], aspect="equal")
        panel.set_axis_off()


def _shade(depth: np.ndarray, normal: np.ndarray, relief: float, radius: float, color: np.ndarray) -> np.ndarray:
    """Return the colors (size, size, 3) of a depth buffer with normals; `relief` is the scale of the depth cue."""
    from scipy.ndimage import distance_transform_edt, gaussian_filter

    covered = np.isfinite(depth)
    # Discs on the rim stand out over the true outline, each a little differently: smooth the outline and pull it in.
    solid = gaussian_filter(covered.astype(float), 0.5 * radius) > OUTLINE
    nearest = tuple(distance_transform_edt(~covered, return_distances=False, return_indices=True))
    depth = depth[nearest]  # Pinholes inside the outline take the pixel beside them.
    normal = normal[nearest]
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-12)
    lambert = normal @ (LIGHT / np.linalg.norm(LIGHT))
    soft = (0.5 + 0.5 * lambert) ** 1.6
    # Only solid pixels take part in the mean depth: the background is nowhere, not far away.
    heights = np.where(solid, depth, 0.0)
    share = np.maximum(gaussian_filter(solid.astype(float), relief), 1e-6)
    dip = (heights - gaussian_filter(heights, relief) / share) / relief
    brightness = (0.22 + 0.92 * soft) * (1 + 0.28 * np.clip(dip, -1.0, 0.25))
    return np.where(solid[..., None], np.clip(color * 1.15 * brightness[..., None], 0, 1), 1.0)


def splat(positions: np.ndarray, facing: np.ndarray, radius: float, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Draw every point as a disc: one pass finds the nearest depth of each pixel, another averages the discs there.

    Positions (P, 3), in pixels, and normals go right, up and towards the eye. Points lie at least a radius inside.

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
