"""Draws a contact sheet: every object of one source as a shaded solid, so that the eye can check the data.

The solid is its points as overlapping discs in their tangent planes (surface splatting, Zwicker et al., SIGGRAPH 2001).
"""

from __future__ import annotations

import math
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.objects.canonical import ObjectClouds
from gpca.process.compilation import njit
from gpca.reporting.figures.cloud_views import view_from
from gpca.reporting.figures.panels import write_below
from gpca.reporting.figures.style import TEXT_WIDTH_IN, use_style, write_title
from gpca.reporting.words import object_in_words

if TYPE_CHECKING:
    from matplotlib.figure import Figure

VIEW = (math.radians(-55), math.radians(32))  # Azimuth and elevation of the eye, z up: it sees front, right and top.
BASE_COLOR = np.array([0.62, 0.70, 0.80])
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


def render_cloud(points: np.ndarray, normals: np.ndarray, view: tuple[float, float], pixels: int) -> np.ndarray:
    """Draw points (P, 3) with outward unit normals as an opaque, shaded solid in orthographic projection.

    Every point is a disc (:func:`splat`); normals that face away are turned towards the eye, as the back of a wall. The
    shading is done once per pixel: Lambert with a soft terminator, darkened where the depth buffer dips behind its
    surroundings (Luft et al., "Image enhancement by unsharp masking the depth buffer", SIGGRAPH 2006).

    Args:
        view: azimuth and elevation of the eye in radians, z up.

    Returns:
        The picture (pixels, pixels, 3) in [0, 1], which the solid fills, row 0 on top, white where nothing is.
    """
    from scipy.spatial import cKDTree

    size = pixels * SUPERSAMPLING
    axes = view_from(*view)
    positions, facing = points @ axes.T, normals @ axes.T
    low, high = positions.min(axis=0), positions.max(axis=0)
    scale = FILL * size / (float((high - low)[:2].max()) or 1.0)
    positions = (positions - (low + high) / 2) * scale
    positions[:, :2] += size / 2
    radius, neighbors = 1.0, min(8, len(positions) - 1)
    if neighbors:  # discs that cover DISC_COVER points, by the distance to the 8th neighbor
        distance, _ = cKDTree(positions).query(positions, k=[neighbors + 1])
        radius = max(1.0, float(np.median(distance)) * math.sqrt(DISC_COVER / neighbors))
    radius = min(radius, LARGEST_DISC * size)
    depth, normal = splat(positions, facing, radius, size)
    image = _shade(depth, normal, relief=size / 40, radius=radius)
    return image.reshape(pixels, SUPERSAMPLING, pixels, SUPERSAMPLING, 3).mean(axis=(1, 3))[::-1]


def _shade(depth: np.ndarray, normal: np.ndarray, relief: float, radius: float) -> np.ndarray:
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
    return np.where(solid[..., None], np.clip(BASE_COLOR * 1.15 * brightness[..., None], 0, 1), 1.0)


def draw_contact_sheet(objects_npz: str | Path, title: str, dataset: str = "") -> Figure:
    """Draw all objects of one source (as `gpca objects` writes them) in tiles, with name and diameter below."""
    objects = ObjectClouds.load(objects_npz)
    count = len(objects)
    # The fewest tiles are empty, of √n to 1.7 √n columns (4 at least), the most columns of equals.
    widest = max(4, math.floor(1.7 * math.sqrt(count)))
    choices = range(widest, max(4, math.ceil(math.sqrt(count))) - 1, -1)
    columns = min(choices, key=lambda columns: -count % columns)
    rows = math.ceil(count / columns)
    tile_in = TEXT_WIDTH_IN / columns
    size_pt = min(7.0, max(4.5, 7.0 * tile_in))
    letters = max(4, int(0.96 * tile_in * 72 / (0.5 * size_pt)))  # in a line; half as wide as high
    captions = ["\n".join(textwrap.wrap(object_in_words(name, dataset), letters)) for name in objects.names]
    caption_in = size_pt * 1.2 / 72 * (max(caption.count("\n") for caption in captions) + 2) + 0.08
    figure = use_style().figure(figsize=(TEXT_WIDTH_IN, 0.36 + rows * (tile_in + caption_in)), layout="constrained")
    figure.get_layout_engine().set(w_pad=0, h_pad=0.02, wspace=0, hspace=0)
    write_title(figure, title)
    grid = figure.add_gridspec(rows, 2 * columns)  # Half tiles, so that a short last row can stand in the middle.
    for index, (name_lines, diameter_m) in enumerate(zip(captions, objects.diameters_m, strict=True)):
        row, column = divmod(index, columns)
        first = 2 * column + columns - min(columns, count - row * columns)
        panel = figure.add_subplot(grid[row, first : first + 2])
        panel.imshow(render_cloud(*objects.clouds[index], VIEW, round(tile_in * 300)), interpolation="antialiased")
        panel.set_axis_off()
        write_below(panel, f"{name_lines}\n{diameter_m * 1000:.0f} mm", fontsize=size_pt, pad=-2)
    return figure


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
