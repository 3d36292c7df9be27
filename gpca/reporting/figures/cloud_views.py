"""Draws two clouds over each other, source on target, seen from one side: the farther a point, the paler it is."""

from pathlib import Path

import numpy as np

from gpca.reporting.figures.panels import legend_below, panels
from gpca.reporting.figures.style import SOURCE_COLOR, TARGET_COLOR, TEXT_WIDTH_IN, save_png, write_title

_POINTS_OF_QUERY = 1500  # of each cloud at most, as more hide one another
_PALEST = 0.65  # share of white in the color of the farthest point


def draw_clouds(axes, target_Q_3: np.ndarray, source_P_3: np.ndarray, size: float = 1.6, corners=None) -> None:
    """Scatter both clouds together from back to front, in the frame of the view: right, up, towards the viewer.

    The size of a point is its area in points². Panels of one scale share the lowest and highest coordinates (2, 3).
    """
    from matplotlib.colors import to_rgb

    points = np.concatenate([target_Q_3, source_P_3])
    low, high = (points.min(axis=0), points.max(axis=0)) if corners is None else corners
    colors = np.repeat([to_rgb(TARGET_COLOR), to_rgb(SOURCE_COLOR)], [len(target_Q_3), len(source_P_3)], axis=0)
    farness = ((high[2] - points[:, 2]) / max(high[2] - low[2], 1e-9))[:, None]
    colors += (1 - colors) * _PALEST * np.clip(farness, 0, 1)
    order = np.argsort(points[:, 2], kind="stable")
    axes.scatter(points[order, 0], points[order, 1], s=size, c=colors[order], linewidths=0)
    margin = 0.02 * float(np.max(high - low))
    axes.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin), aspect="equal")
    axes.set_axis_off()


def thinned(rows: np.ndarray, count: int) -> np.ndarray:
    """Return at most `count` of the rows, spread evenly over their order, which is random or a scan's in a cloud."""
    return rows[np.linspace(0, len(rows) - 1, min(count, len(rows))).astype(int)]


def legend_of_clouds(figure, target: str, source: str, gap: float) -> None:
    """Name the two clouds at the top right of a figure, `gap` letters away from the edges."""
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], linestyle="", marker="o", markersize=3, color=color, label=label)
        for color, label in ((TARGET_COLOR, target), (SOURCE_COLOR, source))
    ]
    figure.legend(handles=handles, loc="upper right", ncols=2, borderaxespad=gap, handletextpad=0.1, columnspacing=1)


def view_from(azimuth_rad: float, elevation_rad: float = np.radians(22.0)) -> np.ndarray:
    """Return the rotation (3, 3) to right, up and towards-the-viewer axes of a view from slightly above, z up."""
    sine, cosine = np.sin(azimuth_rad), np.cos(azimuth_rad)
    towards = np.array([cosine * np.cos(elevation_rad), sine * np.cos(elevation_rad), np.sin(elevation_rad)])
    right = np.array([-sine, cosine, 0.0])
    return np.array([right, np.cross(towards, right), towards])


def widest_views(cloud_P_3: np.ndarray) -> list[np.ndarray]:
    """Return eight of 24 views around a cloud that show it widest: a mug with its handle at the side."""
    views = [view_from(azimuth) for azimuth in np.linspace(0, 2 * np.pi, 24, endpoint=False)]
    return sorted(views, key=lambda view: -np.std(cloud_P_3 @ view[0]))[:8]


def draw_query(cloud_P_3: np.ndarray, target_Q_3: np.ndarray, title: str, png_path: str | Path) -> None:
    """Draw the query for a person as a PNG: the aligned source over its target, along each axis at one scale."""
    clouds = [
        (thinned(target_Q_3, _POINTS_OF_QUERY), TARGET_COLOR, "reference"),
        (thinned(cloud_P_3, _POINTS_OF_QUERY), SOURCE_COLOR, "aligned source"),
    ]
    everything = np.concatenate([cloud for cloud, *_ in clouds])
    center = (everything.min(axis=0) + everything.max(axis=0)) / 2
    reach = 0.52 * float(np.ptp(everything, axis=0).max())
    figure, [drawn] = panels(1, 3, TEXT_WIDTH_IN / 3 + 0.35)
    for panel, (across, up, name) in zip(drawn, ((0, 1, "along z"), (0, 2, "along y"), (1, 2, "along x")), strict=True):
        for cloud, color, label in clouds:
            panel.scatter(cloud[:, across], cloud[:, up], s=1.2, color=color, alpha=0.5, linewidths=0, label=label)
        sides = np.array([-reach, reach])
        panel.set(xlim=center[across] + sides, ylim=center[up] + sides, aspect="equal")
        panel.set_axis_off()
        panel.set_title(name)
    write_title(figure, title)
    legend_below(figure, *drawn[0].get_legend_handles_labels(), markerscale=5)
    save_png(figure, png_path)
