"""Draws accuracy against the severity of the perturbations, and from each source to each other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.errors import InputError
from gpca.experiments.controls.settings import PAPER, TRANSFER
from gpca.experiments.controls.severity import REGISTRATION
from gpca.reporting.figures.panels import (
    color_on_blue,
    draw_percentages,
    in_lines,
    label_outer,
    legend_below,
    panels_in_lines,
)
from gpca.reporting.figures.style import (
    BLACK,
    GRAY,
    LIGHT_GRAY,
    METHOD_LOOKS,
    ORANGE,
    OTHER_LOOK,
    PURPLE,
    SKY_BLUE,
    SMALL_PT,
    TEXT_WIDTH_IN,
    VERMILION,
    blues,
    use_style,
    write_title,
)
from gpca.reporting.tables.cells import rows_where

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

CURVES = {"noise": "standard deviation (% of the diameter)", "overlap": "points cut off (%)"}
# Explainers without a look of their own take the colors in turn, and after all of them the next line and marker.
COLORS = (VERMILION, ORANGE, SKY_BLUE, PURPLE, GRAY)
LINES = (("-", "o"), ((0, (4, 2)), "s"), (":", "^"))
WIDEST = 4  # panels of pose in a row
SUCCEEDS = "registration succeeds"


def draw_severity_curves(severities: pd.DataFrame, explainers: Mapping[str, str], title: str) -> Figure:
    """Draw curves for noise and overlap, and for pose a map of rotation by translation for each explainer.

    Args:
        severities: What :func:`gpca.experiments.controls.severity.collect` returned.
    """
    shown = [name for name in explainers if (severities["method"] == name).any()]
    if not shown:
        raise InputError("severities", "have none of these explainers", "run the controls first")
    plt = use_style()
    maps = [REGISTRATION, *shown]
    lines = -(-len(maps) // WIDEST)
    heights_in = [2.6, *[1.62] * lines]
    figure = plt.figure(figsize=(TEXT_WIDTH_IN, sum(heights_in) + 0.95), layout="constrained")
    grid = figure.add_gridspec(2, 1, height_ratios=[heights_in[0] + 0.55, sum(heights_in[1:]) + 0.2])
    upper, lower = figure.add_subfigure(grid[0]), figure.add_subfigure(grid[1])
    curves = upper.subplots(1, len(CURVES), sharey=True)
    drawn = severities[severities["method"].isin(maps)]
    lowest = _below(drawn[drawn["concept"].isin(CURVES)]["value"])
    for panel, (concept, label) in zip(curves, CURVES.items(), strict=True):
        of_concept = severities[severities["concept"] == concept]
        _draw_curves(panel, of_concept, shown, explainers)
        limits = (100 * of_concept["low"].min(), 100 * of_concept["high"].max())
        panel.set(xlabel=label, title=concept, ylim=(lowest, 101), xlim=limits if len(of_concept) else None)
    curves[0].set_ylabel("accuracy, success (%)")
    handles, labels = curves[0].get_legend_handles_labels()
    legend_below(upper, handles, labels, 3)
    of_pose = drawn[drawn["concept"] == "pose"]
    palest = _below(of_pose["value"])
    axes = lower.subplots(lines, WIDEST, sharex=True, sharey=True, squeeze=False)
    for i, (panel, method) in enumerate(zip(axes.flat, maps, strict=False)):
        image = _draw_map(panel, of_pose[of_pose["method"] == method], palest)
        panel.set_title(in_lines(explainers.get(method, SUCCEEDS)), fontsize=SMALL_PT)
        panel.tick_params(labelbottom=i + WIDEST >= len(maps))  # Where no panel is below it.
    for panel in axes.flat[len(maps) :]:
        panel.set_visible(False)
    lower.supxlabel("pose: rotation (°)", fontsize=8)
    lower.supylabel("translation (% of the diameter)", fontsize=8)
    lower.colorbar(image, ax=axes, shrink=0.8, pad=0.01, label="accuracy, success (%)")
    write_title(figure, title)
    return figure


def _draw_curves(panel, of_concept: pd.DataFrame, shown: list[str], explainers: Mapping[str, str]) -> None:
    """Draw a curve for each explainer, and over them all that of the registrations that succeed."""
    looks = iter(((color, line, 1.1), marker) for line, marker in LINES for color in COLORS)
    for method in [*shown, REGISTRATION]:
        rows = of_concept[of_concept["method"] == method].sort_values("low")
        middles = 100 * (rows["low"] + rows["high"]) / 2
        if method == REGISTRATION:
            style = {"color": BLACK, "linewidth": 1.4, "label": SUCCEEDS, "marker": "D", "markersize": 4}
        else:
            own = (METHOD_LOOKS[method], "o") if method in METHOD_LOOKS else next(looks, (OTHER_LOOK, "o"))
            (color, line, width), marker = own
            style = {"color": color, "linestyle": line, "linewidth": width, "label": explainers[method]}
            style |= {"marker": marker, "markersize": 3}
        panel.plot(middles, 100 * rows["value"], **style)


def _below(value_B: pd.Series) -> float:
    """Return the multiple of ten, in %, that all values are above; a scale from there on tells them apart."""
    return float(np.clip(10 * np.floor(10 * value_B.min() - 0.1), 0, 90)) if len(value_B) else 0.0


def _draw_map(panel, rows: pd.DataFrame, palest: float):
    """Draw one map of pose, white at `palest`; every bin has its share in %, an empty one is gray."""
    edges = np.unique(np.r_[rows["low"], rows["high"]].round(9))
    others = np.unique(np.r_[rows["other_low"], rows["other_high"]].round(9))
    shares = np.full((len(others) - 1, len(edges) - 1), np.nan)
    for low, other_low, value in zip(rows["low"], rows["other_low"], rows["value"], strict=True):
        shares[np.searchsorted(others, round(other_low, 9)), np.searchsorted(edges, round(low, 9))] = 100 * value
    panel.set_facecolor(LIGHT_GRAY)
    look: dict[str, Any] = {"cmap": blues(), "vmin": palest, "vmax": 100}
    image = panel.pcolormesh(edges, 100 * others, np.ma.masked_invalid(shares), **look)
    for (row, column), share in np.ndenumerate(shares):
        if np.isfinite(share):
            place = ((edges[column] + edges[column + 1]) / 2, 50 * (others[row] + others[row + 1]))
            color = color_on_blue((share - palest) / (100 - palest))
            panel.text(*place, f"{share:.0f}", ha="center", va="center", fontsize=SMALL_PT, color=color)
    panel.tick_params(labelsize=SMALL_PT)
    return image


def draw_transfer(intervals: pd.DataFrame, sources: Mapping[str, str], explainers: Mapping[str, str]) -> Figure:
    """Draw a matrix for each explainer: rows are the sources that it learned from, columns those that it explains.

    Args:
        intervals: What :func:`gpca.experiments.controls.metrics.collect_intervals` returned.
    """
    accuracy = rows_where(intervals, metric="accuracy")
    moved = rows_where(accuracy, control=TRANSFER)
    shown = [name for name in explainers if (moved["method"] == name).any()]
    if not shown:
        raise InputError("intervals", "have no transfer", "run the controls of two sources first")
    figure, drawn = panels_in_lines(len(shown), 1.55)
    letters = [chr(ord("A") + i) for i in range(len(sources))]
    for panel, name in zip(drawn, shown, strict=True):
        shares = _matrix(rows_where(accuracy, method=name), list(sources))
        draw_percentages(panel, shares, "{:.1f}")
        panel.set_title(in_lines(explainers[name]), fontsize=SMALL_PT)
        panel.set_xticks(range(len(letters)), letters)
        panel.set_yticks(range(len(letters)), letters)
        panel.tick_params(length=0, labelsize=SMALL_PT)
        panel.set_box_aspect(1)
    label_outer(drawn, "", "learned from")
    key = ", ".join(f"{letter} {title}" for letter, title in zip(letters, sources.values(), strict=True))
    write_title(figure, f"Accuracy (%) on the test samples of the column. {key}")
    return figure


def _matrix(accuracy: pd.DataFrame, sources: list[str]) -> np.ndarray:
    shares = np.full((len(sources), len(sources)), np.nan)
    for row, trained_on in enumerate(sources):
        for column, tested in enumerate(sources):
            control = PAPER if row == column else TRANSFER
            tests = rows_where(accuracy, control=control, source=tested, trained_on=trained_on)
            if len(tests):
                shares[row, column] = 100 * tests["value"].iloc[0]
    return shares
