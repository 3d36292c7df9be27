"""Draws accuracy, and the share of registrations that succeed, against the severity of what was perturbed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.controls.severity import REGISTRATION
from gpca.errors import InputError
from gpca.reporting.figures.panels import in_lines
from gpca.reporting.figures.style import (
    BLACK,
    GREY,
    METHOD_LOOKS,
    OTHER_LOOK,
    PALETTE,
    SMALL_PT,
    TEXT_WIDTH_IN,
    blues,
    save_figure,
    use_style,
    write_title,
)

if TYPE_CHECKING:
    import pandas as pd

CURVES = {"noise": "standard deviation (% of the diameter)", "overlap": "points cut off (%)"}
LINES = ("-", (0, (4, 2)), ":")
WIDEST = 4  # panels of pose in a row
SUCCEEDS = "registration succeeds"


def draw_severity_curves(
    severities: pd.DataFrame, explainers: Mapping[str, str], title: str, pdf_path: str | Path, png_path: str | Path
) -> None:
    """Draw curves for noise and overlap, and for pose a map of rotation by translation for each explainer.

    Args:
        severities: What :func:`gpca.controls.severity.collect` returned.
        explainers: The title of each name, in order; those without numbers are left out.
        title: What stands above.
        pdf_path, png_path: The two files to write.

    Raises:
        InputError: the severities hold none of these.
    """
    shown = [name for name in explainers if (severities["method"] == name).any()]
    if not shown:
        raise InputError("severities", "have none of these explainers", "run the controls first")
    use_style()
    import matplotlib.pyplot as plt
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    maps = [REGISTRATION, *shown]
    lines = -(-len(maps) // WIDEST)
    heights_in = [2.1, *[1.62] * lines]
    height_in = sum(heights_in) + 0.95
    below_title = ConstrainedLayoutEngine(rect=(0, 0, 1, 1 - 0.2 / height_in))
    figure = plt.figure(figsize=(TEXT_WIDTH_IN, height_in), layout=below_title)
    grid = figure.add_gridspec(2, 1, height_ratios=[heights_in[0] + 0.55, sum(heights_in[1:]) + 0.2])
    upper, lower = figure.add_subfigure(grid[0]), figure.add_subfigure(grid[1])
    panels = upper.subplots(1, len(CURVES), sharey=True)
    for panel, (concept, label) in zip(panels, CURVES.items(), strict=True):
        of_concept = severities[severities["concept"] == concept]
        _draw_curves(panel, of_concept, shown, explainers)
        limits = (100 * of_concept["low"].min(), 100 * of_concept["high"].max())
        panel.set(xlabel=label, title=concept, ylim=(0, 102), xlim=limits if len(of_concept) else None)
    panels[0].set_ylabel("accuracy, success (%)")
    handles, labels = panels[0].get_legend_handles_labels()
    upper.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=SMALL_PT, columnspacing=1.2)
    of_pose = severities[severities["concept"] == "pose"]
    axes = lower.subplots(lines, WIDEST, sharex=True, sharey=True, squeeze=False)
    for panel, method in zip(axes.flat, maps, strict=False):
        image = _draw_map(panel, of_pose[of_pose["method"] == method])
        panel.set_title(in_lines(explainers.get(method, SUCCEEDS)), fontsize=SMALL_PT)
    for panel in axes.flat[len(maps) :]:
        panel.set_visible(False)
    lower.supxlabel("pose: rotation (°)", fontsize=8)
    lower.supylabel("translation (% of the diameter)", fontsize=8)
    lower.colorbar(image, ax=axes, shrink=0.8, pad=0.01, label="accuracy, success (%)")
    write_title(figure, title)
    save_figure(figure, pdf_path, png_path)


def _draw_curves(panel, of_concept: pd.DataFrame, shown: list[str], explainers: Mapping[str, str]) -> None:
    known = {METHOD_LOOKS[name][0] for name in shown if name in METHOD_LOOKS}
    looks = iter((colour, line, 1.1) for line in LINES for colour in PALETTE if colour not in {*known, BLACK})
    for method in [REGISTRATION, *shown]:
        rows = of_concept[of_concept["method"] == method].sort_values("low")
        middles = 100 * (rows["low"] + rows["high"]) / 2
        if method == REGISTRATION:
            style = {"color": BLACK, "linewidth": 2.2, "label": SUCCEEDS, "alpha": 0.5}
        else:
            colour, line, width = METHOD_LOOKS[method] if method in METHOD_LOOKS else next(looks, OTHER_LOOK)
            style = {"color": colour, "linestyle": line, "linewidth": width, "label": explainers[method]}
        panel.plot(middles, 100 * rows["value"], marker="o", markersize=2.2, **style)


def _draw_map(panel, rows: pd.DataFrame):
    """Draw one map of pose; every bin has its number of samples' share in %, an empty one is grey."""
    edges = np.unique(np.r_[rows["low"], rows["high"]].round(9))
    others = np.unique(np.r_[rows["other_low"], rows["other_high"]].round(9))
    shares = np.full((len(others) - 1, len(edges) - 1), np.nan)
    for low, other_low, value in zip(rows["low"], rows["other_low"], rows["value"], strict=True):
        shares[np.searchsorted(others, round(other_low, 9)), np.searchsorted(edges, round(low, 9))] = 100 * value
    panel.set_facecolor(GREY)
    image = panel.pcolormesh(edges, 100 * others, np.ma.masked_invalid(shares), cmap=blues(), vmin=0, vmax=100)
    for (row, column), share in np.ndenumerate(shares):
        if np.isfinite(share):
            place = ((edges[column] + edges[column + 1]) / 2, 50 * (others[row] + others[row + 1]))
            panel.text(*place, f"{share:.0f}", ha="center", va="center", fontsize=SMALL_PT,
                       color="white" if share > 65 else "black")  # fmt: skip
    panel.tick_params(labelsize=SMALL_PT)
    return image
