"""Draws the registration that a person is asked about: the aligned cloud over its reference, from three sides."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gpca.reporting.figures.cloud_views import thinned
from gpca.reporting.figures.panels import legend_below, panels
from gpca.reporting.figures.style import SOURCE_COLOUR, TARGET_COLOUR, TEXT_WIDTH_IN, save_png, write_title

_POINTS = 1500  # At most this many points of each cloud are drawn, as more hide one another.


def draw_query(cloud_P_3: np.ndarray, target_Q_3: np.ndarray, title: str, png_path: str | Path) -> None:
    """Draw source over target along each axis, at one scale, into a PNG."""
    clouds = [
        (thinned(target_Q_3, _POINTS), TARGET_COLOUR, "reference"),
        (thinned(cloud_P_3, _POINTS), SOURCE_COLOUR, "aligned source"),
    ]
    everything = np.concatenate([cloud for cloud, *_ in clouds])
    center = (everything.min(axis=0) + everything.max(axis=0)) / 2
    reach = 0.52 * float(np.ptp(everything, axis=0).max())
    figure, [drawn] = panels(1, 3, TEXT_WIDTH_IN / 3 + 0.35)
    for panel, (across, up, name) in zip(drawn, ((0, 1, "along z"), (0, 2, "along y"), (1, 2, "along x")), strict=True):
        for cloud, colour, label in clouds:
            panel.scatter(cloud[:, across], cloud[:, up], s=1.2, color=colour, alpha=0.5, linewidths=0, label=label)
        sides = np.array([-reach, reach])
        panel.set(xlim=center[across] + sides, ylim=center[up] + sides, aspect="equal")
        panel.set_axis_off()
        panel.set_title(name)
    write_title(figure, title)
    legend_below(figure, *drawn[0].get_legend_handles_labels(), markerscale=5)
    save_png(figure, png_path)
