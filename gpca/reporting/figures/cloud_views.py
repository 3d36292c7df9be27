"""Two clouds drawn over each other, source on target, from one side: the farther a point, the paler."""

from __future__ import annotations

import numpy as np

from gpca.reporting.figures.style import SOURCE_COLOUR, TARGET_COLOUR

_ELEVATION_RAD = np.radians(22.0)
_PALEST = 0.65  # share of white in the colour of the farthest point


def draw_clouds(axes, target_Q_3: np.ndarray, source_P_3: np.ndarray, size: float = 1.6, corners=None) -> None:
    """Scatter both clouds together from back to front, without axes.

    Args:
        axes: that are drawn on.
        target_Q_3, source_P_3: in the frame of the view: right, up, towards the viewer.
        size: of a point, in points².
        corners: lowest and highest coordinates (2, 3) that panels of one scale share; by default those of the clouds.
    """
    from matplotlib.colors import to_rgb

    points = np.concatenate([target_Q_3, source_P_3])
    low, high = (points.min(axis=0), points.max(axis=0)) if corners is None else corners
    colours = np.repeat([to_rgb(TARGET_COLOUR), to_rgb(SOURCE_COLOUR)], [len(target_Q_3), len(source_P_3)], axis=0)
    farness = ((high[2] - points[:, 2]) / max(high[2] - low[2], 1e-9))[:, None]
    colours += (1 - colours) * _PALEST * np.clip(farness, 0, 1)
    order = np.argsort(points[:, 2], kind="stable")
    axes.scatter(points[order, 0], points[order, 1], s=size, c=colours[order], linewidths=0)
    margin = 0.02 * float(np.max(high - low))
    axes.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin), aspect="equal")
    axes.set_axis_off()


def view_from(azimuth_rad: float) -> np.ndarray:
    """Return the rotation (3, 3) to right, up and towards-the-viewer axes of a view from slightly above, z up."""
    sine, cosine = np.sin(azimuth_rad), np.cos(azimuth_rad)
    towards = np.array([cosine * np.cos(_ELEVATION_RAD), sine * np.cos(_ELEVATION_RAD), np.sin(_ELEVATION_RAD)])
    right = np.array([-sine, cosine, 0.0])
    return np.array([right, np.cross(towards, right), towards])


def views_around(count: int = 24) -> list[np.ndarray]:
    """Return the views from so many directions around the object."""
    return [view_from(azimuth) for azimuth in np.linspace(0, 2 * np.pi, count, endpoint=False)]


def widest_views(cloud_P_3: np.ndarray, count: int = 8) -> list[np.ndarray]:
    """Return those of the views around a cloud that show it widest: a mug with its handle at the side."""
    return sorted(views_around(), key=lambda view: -np.std(cloud_P_3 @ view[0]))[:count]
