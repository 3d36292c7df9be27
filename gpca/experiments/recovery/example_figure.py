"""Draws Fig. 1 of the paper: one failure of the run, attributed to a concept, seen from a new viewpoint, and solved."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.experiments.real_world.frame_views import draw_score_bars
from gpca.io.arrays import load_arrays
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures.panels import legend_below, write_below
from gpca.reporting.figures.style import (
    BLACK,
    SMALL_PT,
    TARGET_COLOR,
    TEXT_WIDTH_IN,
    VERMILION,
    YELLOW,
    blues,
    use_style,
    write_title,
)
from gpca.reporting.words import in_words, object_in_words

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SILHOUETTES = ("mask", "true", "placed")
Look = tuple[str, Any]  # color and line
VISIBLE: Look = (YELLOW, "-")  # outlines of the object
HIDDEN: Look = (YELLOW, "--")
PLACED: Look = (TARGET_COLOR, "-")  # of the model where ICP put it
LINE_PT, RIM_PT = 1.0, 1.9
SHAPES: dict[str, tuple[int | str, ...]] = {
    "object": (),
    "cause": (),
    "action": (),
    "scores": (len(CONCEPTS),),
    "errors": (2,),
    "viewpoints_n_3": ("V", 3),
    "viewpoint_first": (3,),
    "surface_n": ("V",),
    "surface_first": (),
    "chosen": (),
    **{f"image_{view}": ("H", "W", 3) for view in ("first", "next")},
    **{f"{silhouette}_{view}": ("H", "W") for view in ("first", "next") for silhouette in SILHOUETTES},
}


def draw_recovery_example(title: str, example_npz: str | Path, success: float, dataset: str = "") -> Figure:
    """Draw (a) the first view, (b) the concept scores, (c) the viewpoints to choose from, (d) the new view.

    Both views show the outlines of the object, where it is and where ICP put it: between them lies the misfit. The
    object's name in words follows from its `dataset` of the BOP benchmark. A pose is solved if its error is below
    `success`, in diameters.
    """
    example = load_arrays(example_npz, SHAPES)
    figure = use_style().figure(figsize=(TEXT_WIDTH_IN, 2.2), layout="constrained")
    polar = {"c": {"projection": "polar"}}
    axes = figure.subplot_mosaic("abcd", width_ratios=(2.2, 1.3, 1.6, 2.2), per_subplot_kw=polar)
    for letter, view in (("a", "first"), ("d", "next")):
        silhouettes = (example[f"{name}_{view}"].astype(bool) for name in SILHOUETTES)
        _draw_view(axes[letter], example[f"image_{view}"], *silhouettes)
    shown = example["scores"]
    draw_score_bars(axes["b"], shown.tolist(), str(example["cause"]))
    axes["b"].set(xlim=(min(0, shown.min()), max(1, shown.max())), box_aspect=1)
    _draw_viewpoints(figure, axes["c"], example)
    view = "Occluded" if str(example["cause"]) == "overlap" else "First view"
    before, after = (100 * error for error in example["errors"])
    solved = "solved" if after < 100 * success else "not solved"
    chosen, first = (100 * share for share in (example["surface_n"][int(example["chosen"])], example["surface_first"]))
    captions = (
        f"(a) {view}: pose {before:.0f} % $d$ off",
        f"(b) Scores, the truth bold{_instead(str(example['action']))}",
        f"(c) Seen: {first:.0f} %; expected: {chosen:.0f} %",
        f"(d) New view: {after:.1f} % $d$ off, {solved}",
    )
    for letter, caption in zip("acd", (captions[0], *captions[2:]), strict=True):
        write_below(axes[letter], caption)
    axes["b"].set_xlabel(captions[1], labelpad=1)
    name = object_in_words(example["object"], dataset)
    write_title(figure, f"{title}: {name}")
    _name_lines(figure)
    return figure


def _draw_view(panel, image: np.ndarray, mask: np.ndarray, true: np.ndarray, placed: np.ndarray) -> None:
    """Show the part of an image around both outlines; the visible part of the object is outlined in full."""
    panel.imshow(image)
    for silhouette, color, line in ((true, *HIDDEN), (mask, *VISIBLE), (placed, *PLACED)):
        if silhouette.any():
            panel.contour(silhouette, [0.5], colors=BLACK, linewidths=RIM_PT)  # seen on any color
            panel.contour(silhouette, [0.5], colors=color, linewidths=LINE_PT, linestyles=line)
    height, width = mask.shape
    v, u = np.nonzero(true | placed | mask)
    half_v = np.clip(0.75 * max(np.ptp(v), np.ptp(u) * height / width), height / 5, height / 2)
    half_u = half_v * width / height
    center_u = np.clip((u.min() + u.max()) / 2, half_u, width - half_u)
    center_v = np.clip((v.min() + v.max()) / 2, half_v, height - half_v)
    panel.set(xlim=(center_u - half_u, center_u + half_u - 1), ylim=(center_v + half_v - 1, center_v - half_v))
    panel.set_axis_off()


def _draw_viewpoints(figure, panel, example: Mapping[str, np.ndarray]) -> None:
    """Show the viewpoints from above: the darker, the more surface should be seen after it; the chosen is ringed."""
    towards = example["viewpoints_n_3"]
    azimuth, zenith_deg = np.arctan2(towards[:, 1], towards[:, 0]), _zenith_deg(towards)
    seen_n = 100 * example["surface_n"]
    most = float(np.ceil(seen_n.max() / 10) * 10) or 100.0
    look = {"cmap": blues(), "vmin": 0, "vmax": most, "edgecolors": BLACK}
    widths = np.where(np.arange(len(towards)) == int(example["chosen"]), 1.6, 0.3)
    dots = panel.scatter(azimuth, zenith_deg, c=seen_n, s=24, linewidths=widths, **look)
    first = example["viewpoint_first"]
    panel.scatter(np.arctan2(first[1], first[0]), _zenith_deg(first), marker="x", s=22, color=VERMILION)
    panel.set(rlim=(0, 90), xticks=[], yticks=[30, 60, 90])
    panel.set_yticklabels([])
    bar = figure.colorbar(dots, ax=panel, shrink=0.7, pad=0.02, aspect=25, ticks=[0, most / 2, most])
    bar.set_label("surface seen (%)", fontsize=SMALL_PT, labelpad=1)
    bar.ax.tick_params(labelsize=SMALL_PT, length=1.5, pad=1)
    bar.outline.set_linewidth(0.4)


def _name_lines(figure) -> None:
    """Name the outlines and the marks of the viewpoints below all panels."""
    from matplotlib.lines import Line2D
    from matplotlib.patheffects import withStroke

    rim: dict[str, Any] = {"linewidth": LINE_PT, "path_effects": [withStroke(linewidth=RIM_PT, foreground=BLACK)]}
    outlines = (("where it is", VISIBLE), ("its hidden part", HIDDEN), ("where ICP put it", PLACED))
    handles = [Line2D([], [], label=words, color=look[0], linestyle=look[1], **rim) for words, look in outlines]
    mark: dict[str, Any] = {"linestyle": "", "markersize": 4}
    handles += [
        Line2D([], [], label="first view", marker="x", color=VERMILION, **mark),
        Line2D([], [], label="chosen", marker="o", color="white", markeredgecolor=BLACK, markeredgewidth=1.6, **mark),
    ]
    legend_below(figure, handles)


def _zenith_deg(towards: np.ndarray) -> np.ndarray:
    return np.rad2deg(np.arccos(np.clip(towards[..., 2], -1, 1)))


def _instead(action: str) -> str:
    """Return the policy's action, if it did not change the viewpoint, in the words of the panels."""
    return "" if action == "new_view" else f" ({in_words(action)})"
