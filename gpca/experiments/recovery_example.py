"""Figures 1 and 6 of the paper: one failure of the run and its recovery, and the policy from scores to actions."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gpca.declarations import Figure, Run, figure
from gpca.experiments.recovery import SECTION, tables_title
from gpca.experiments.registration_stages import draw_score_bars
from gpca.io.arrays import load_arrays
from gpca.objects.entry import dataset_of
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures import style
from gpca.reporting.figures.diagram import Canvas
from gpca.reporting.figures.panels import legend_below, write_below
from gpca.reporting.words import in_words, object_in_words, plural

ACTION = "new_view"  # that the example shows
WORDS = {
    "reinitialize": "Reinitialize ICP\nbroader search over orientations",
    "new_view": "Change the viewpoint\nmore of the surface in sight",
    "denoise": "Filter, check the sensor\nseveral frames, outliers removed",
}
SILHOUETTES = ("mask", "true", "placed")
Look = tuple[str, Any]  # color and line
VISIBLE: Look = (style.YELLOW, "-")  # outlines of the object
HIDDEN: Look = (style.YELLOW, "--")
PLACED: Look = (style.TARGET_COLOR, "-")  # of the model where ICP put it
LINE_PT, RIM_PT = 1.0, 1.9
SHAPES: dict[str, tuple[int | str, ...]] = {
    **dict.fromkeys(("object", "cause", "action", "surface_first", "chosen"), ()),
    "scores": (len(CONCEPTS),),
    "errors": (2,),
    "viewpoints_n_3": ("V", 3),
    "viewpoint_first": (3,),
    "surface_n": ("V",),
    **{f"image_{view}": ("H", "W", 3) for view in ("first", "next")},
    **{f"{silhouette}_{view}": ("H", "W") for view in ("first", "next") for silhouette in SILHOUETTES},
}


@figure(
    SECTION,
    "Figure 1: a failure and its recovery",
    """After Figure 1 of the paper: a registration that failed because the object is hidden, GP-CA's scores, the
    viewpoints to choose from, seen from above, and the registration in the one chosen. Of the failures of the first
    seed that lack overlap and that a new view solved by GP-CA's policy, it is the one with the median score. The tables
    are rendered and the objects' colors made up.""",
    paper=True,
    example_npz="recovery/example_seed{first_seed}.npz",
)
def fig1_recovery_example(run: Run, example_npz: str | Path) -> Figure:
    """(a) The first view, (b) the concept scores, (c) the viewpoints to choose from, (d) the new view."""
    from matplotlib.lines import Line2D
    from matplotlib.patheffects import withStroke

    entry = run.config["sources"][run.config["recovery"]["objects"]]
    example = load_arrays(example_npz, SHAPES)
    drawing = style.use_style().figure(figsize=(style.TEXT_WIDTH_IN, 2.2), layout="constrained")
    polar = {"c": {"projection": "polar"}}
    axes = drawing.subplot_mosaic("abcd", width_ratios=(2.2, 1.3, 1.6, 2.2), per_subplot_kw=polar)
    for letter, view in (("a", "first"), ("d", "next")):
        silhouettes = (example[f"{name}_{view}"].astype(bool) for name in SILHOUETTES)
        _draw_view(axes[letter], example[f"image_{view}"], *silhouettes)
    shown = example["scores"]
    draw_score_bars(axes["b"], shown.tolist(), str(example["cause"]))
    axes["b"].set(xlim=(min(0, shown.min()), max(1, shown.max())), box_aspect=1)
    _draw_viewpoints(drawing, axes["c"], example)
    view = "Occluded" if str(example["cause"]) == "overlap" else "First view"
    before, after = (100 * error for error in example["errors"])
    solved = "solved" if after < 100 * run.config["success"]["error"] else "not solved"
    chosen, first = 100 * example["surface_n"][int(example["chosen"])], 100 * example["surface_first"]
    action = str(example["action"])
    instead = "" if action == ACTION else f" ({in_words(action)})"  # the policy's action, if it is another
    write_below(axes["a"], f"(a) {view}: pose {before:.0f} % $d$ off")
    axes["b"].set_xlabel(f"(b) Scores, the truth bold{instead}", labelpad=1)
    write_below(axes["c"], f"(c) Seen: {first:.0f} %; expected: {chosen:.0f} %")
    write_below(axes["d"], f"(d) New view: {after:.1f} % $d$ off, {solved}")
    name = object_in_words(example["object"], dataset_of(entry))
    style.write_title(drawing, f"{tables_title(run)}: {name}")
    outlines = (("where it is", VISIBLE), ("its hidden part", HIDDEN), ("where ICP put it", PLACED))
    rim: dict[str, Any] = {"linewidth": LINE_PT, "path_effects": [withStroke(linewidth=RIM_PT, foreground=style.BLACK)]}
    handles = [Line2D([], [], label=words, color=look[0], linestyle=look[1], **rim) for words, look in outlines]
    ring: dict[str, Any] = {"marker": "o", "color": "white", "markeredgecolor": style.BLACK, "markeredgewidth": 1.6}
    for words, mark in (("first view", {"marker": "x", "color": style.VERMILION}), ("chosen", ring)):
        handles.append(Line2D([], [], label=words, linestyle="", markersize=4, **mark))
    legend_below(drawing, handles)
    return drawing


def _draw_view(panel, image: np.ndarray, mask: np.ndarray, true: np.ndarray, placed: np.ndarray) -> None:
    panel.imshow(image)
    for silhouette, color, line in ((true, *HIDDEN), (mask, *VISIBLE), (placed, *PLACED)):
        if silhouette.any():
            panel.contour(silhouette, [0.5], colors=style.BLACK, linewidths=RIM_PT)  # seen on any color
            panel.contour(silhouette, [0.5], colors=color, linewidths=LINE_PT, linestyles=line)
    height, width = mask.shape
    v, u = np.nonzero(true | placed | mask)
    half_v = np.clip(0.75 * max(np.ptp(v), np.ptp(u) * height / width), height / 5, height / 2)
    half_u = half_v * width / height
    center_u = np.clip((u.min() + u.max()) / 2, half_u, width - half_u)
    center_v = np.clip((v.min() + v.max()) / 2, half_v, height - half_v)
    panel.set(xlim=(center_u - half_u, center_u + half_u - 1), ylim=(center_v + half_v - 1, center_v - half_v))
    panel.set_axis_off()


def _draw_viewpoints(drawing, panel, example: Mapping[str, np.ndarray]) -> None:
    """The viewpoints from above: the darker, the more surface should be seen after it; the chosen is ringed."""
    towards = example["viewpoints_n_3"]
    azimuth, zenith_deg = np.arctan2(towards[:, 1], towards[:, 0]), _zenith_deg(towards)
    seen_n = 100 * example["surface_n"]
    most = float(np.ceil(seen_n.max() / 10) * 10) or 100.0
    look = {"cmap": style.blues(), "vmin": 0, "vmax": most, "edgecolors": style.BLACK}
    widths = np.where(np.arange(len(towards)) == int(example["chosen"]), 1.6, 0.3)
    dots = panel.scatter(azimuth, zenith_deg, c=seen_n, s=24, linewidths=widths, **look)
    first = example["viewpoint_first"]
    panel.scatter(np.arctan2(first[1], first[0]), _zenith_deg(first), marker="x", s=22, color=style.VERMILION)
    panel.set(rlim=(0, 90), xticks=[], yticks=[30, 60, 90])
    panel.set_yticklabels([])
    bar = drawing.colorbar(dots, ax=panel, shrink=0.7, pad=0.02, aspect=25, ticks=[0, most / 2, most])
    bar.set_label("surface seen (%)", fontsize=style.SMALL_PT, labelpad=1)
    bar.ax.tick_params(labelsize=style.SMALL_PT, length=1.5, pad=1)
    bar.outline.set_linewidth(0.4)


def _zenith_deg(towards: np.ndarray) -> np.ndarray:
    return np.rad2deg(np.arccos(np.clip(towards[..., 2], -1, 1)))


@figure(
    SECTION,
    "Figure 6: from scores to actions",
    """After Figure 6 of the paper: scores and uncertainty lead to one of four branches, by the thresholds of this run's
    policy. A person labels the queued cases, and what is learned from these labels decides the next cases.""",
    paper=True,
    policy_json="recovery/policy_seed{first_seed}.json",
)
def fig6_mitigation(run: Run, policy_json: str | Path) -> Figure:
    """The inputs of one policy, its branches in the order of the tests, and the ways back."""
    policy = json.loads(Path(policy_json).read_text(encoding="utf-8"))
    limits, treatments = policy["thresholds"], policy["treatments"]
    canvas = Canvas(style.TEXT_WIDTH_IN, 2.62)
    style.write_title(canvas.figure, f"{tables_title(run)}: thresholds of this run")
    words = "GP-CA\n" + r"scores $\hat{s}_c$, variances $v_c$," + "\nBALD"
    canvas.box(0.04, 0.86, 1.3, 0.66, words)
    dominant = rf"$\mathrm{{max}}_c\,\hat{{s}}_c$ < {limits['dominant']:.2f}"
    uncertain = f"BALD > {limits['uncertain']:.3f} nats\nor {dominant}"
    branches = [(uncertain, "Abstain\nqueue for a person", style.GRAY)]
    for concept in ("pose", "overlap", "noise"):
        words = WORDS.get(treatments[concept], in_words(treatments[concept]))
        branches.append((f"{concept} dominates", words, style.CONCEPT_COLORS[concept]))
    middles_in = [1.99 - 0.53 * place for place in range(len(branches))]
    for middle_in, (condition, branch, color) in zip(middles_in, branches, strict=True):
        canvas.box(1.95, middle_in - 0.2, 1.6, 0.4, condition, color, dashed=True)
        canvas.box(3.95, middle_in - 0.2, 1.85, 0.4, branch, color)
        canvas.arrow((1.34, 1.19), (1.62, 1.19), (1.62, middle_in), (1.95, middle_in))
        canvas.arrow((3.55, middle_in), (3.95, middle_in), color=color)
        canvas.arrow((5.8, middle_in), (6.05, middle_in))
    canvas.box(6.05, middles_in[0] - 0.2, 1.06, 0.4, "A person labels it\nthe GPC learns it")
    over_in = middles_in[0] + 0.32
    canvas.arrow((6.58, middles_in[0] + 0.2), (6.58, over_in), (0.69, over_in), (0.69, 1.52))
    canvas.text(3.6, over_in + 0.03, "the classifier that has learned the label decides all later cases", va="bottom")
    attempts = f"{limits['attempts']:.0f}"
    back = (
        "Register and\nscore anew\n\n"
        r"$\hat{s}_c$ falls by less" + f"\nthan {limits['improvement']:.2f}: next\nconcept; after\n"
        f"{plural(attempts, 'such attempt')}:\nqueue"
    )
    canvas.box(6.05, middles_in[-1] - 0.2, 1.06, middles_in[1] - middles_in[-1] + 0.4, back)
    canvas.arrow((6.58, middles_in[-1] - 0.2), (6.58, 0.06), (0.69, 0.06), (0.69, 0.86))
    return canvas.figure


def short_action(action: str) -> str:
    """Words for an action of recovery, without its purpose."""
    return WORDS.get(action, in_words(action)).splitlines()[0].rstrip(",")
