"""Draws one explanation in one look: both clouds, the causes, what would have been without them, and what to do."""

from dataclasses import replace
from pathlib import Path
from textwrap import wrap

import numpy as np

from gpca.causes.truth import BY_SIZE, SUBSETS
from gpca.model.explanation import Explanation
from gpca.model.scene import Scene, taken_out
from gpca.reporting.figures import style
from gpca.reporting.figures.cloud_views import thinned, widest_views
from gpca.rigid import transform

VIEW_IN, BAR_IN, BELOW_IN = 2.2, 0.95, 2.0  # width of a view; heights of what stands around the views, and below them
POINTS = 1500  # of each cloud; more hide one another
BRIGHTEST = 0.8  # of viridis; what is brighter is lost on white
OUTSIDE = 0.01  # share of the points after the registration that the panels may leave out
LETTERS = 46  # in a line of text
MOST_LINES = 12
Views = list[tuple[str, np.ndarray]]  # title, cloud
SHOWN = ("state", "result", "alarm", "action")  # labels of lines, beside that of the set
WITHOUT = {"noise": "without noise", "pose": "with the right start", "overlap": "with full overlap"}
ROWS = [subset for subset in BY_SIZE if len(SUBSETS[subset]) in (0, 2, 3)]  # all causes, one of them gone, none


def draw_explanation(explanation: Explanation, png_path: str | Path, names: str = "") -> None:
    """Write one explanation as a PNG of 200 dpi, with a title; ValueError for one without a scene."""
    if (scene := explanation.scene) is None:
        raise ValueError("an explanation that came as one of many has no clouds to draw")
    views = _views(explanation, scene)
    view = widest_views(scene.target)[0]
    placed = np.concatenate([cloud for _, cloud in views[1:]]) @ view.T
    outer = np.concatenate([scene.target @ view.T, np.quantile(placed, (OUTSIDE, 1 - OUTSIDE), axis=0)])[:, :2]
    margin = 0.02 * np.ptp(outer, axis=0).max()
    corners_2_2 = np.stack([outer.min(axis=0) - margin, outer.max(axis=0) + margin], axis=1)
    wide, high = np.ptp(corners_2_2, axis=1)
    above_in = BAR_IN + VIEW_IN * min(high / wide, 1.2)
    figure = style.use_style().figure(figsize=(style.TEXT_WIDTH_IN, above_in + BELOW_IN), layout="constrained")
    above, below = figure.subfigures(2, 1, height_ratios=(above_in, BELOW_IN))
    _draw_views(above, explanation.unit, scene, views, view, corners_2_2)
    left, middle, right = below.subplots(1, 3, width_ratios=(1, 1, 1.3))
    _draw_causes(left, explanation)
    _draw_what_ifs(middle, scene, explanation.unit)
    wrapped = [part for line in _lines(explanation) for part in wrap(line, LETTERS, subsequent_indent="   ")]
    text = "\n".join(wrapped[:MOST_LINES] + ["…"] * (len(wrapped) > MOST_LINES))
    look = {"va": "top", "ha": "left", "fontsize": style.SMALL_PT, "linespacing": 1.4, "in_layout": False}
    right.set_axis_off()
    right.text(0, 1, text, transform=right.transAxes, parse_math=False, **look)
    style.write_title(figure, names)
    style.save_png(figure, png_path, dpi=200)


def _views(explanation: Explanation, scene: Scene) -> Views:
    views = [("before", scene.source), ("after", scene.aligned)]
    if scene.T_repaired is not None:
        return [*views, ("repaired", transform(scene.T_repaired, scene.source))]
    if not explanation.unknown:
        poses = enumerate(zip(explanation.diagnosis.reenacted.poses, scene.possibilities, strict=True), 1)
        for k, other in [(k, possibility) for k, (pose, possibility) in poses if not pose.registered][:1]:
            title = f"pose {k} (probability {other.probability:.2f})"  # the most probable
            views.append((title, transform(other.T, scene.source)))
    return views


def _draw_views(figure, unit: str, scene: Scene, views: Views, view: np.ndarray, corners_2_2: np.ndarray) -> None:
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap
    from scipy.spatial import cKDTree

    panels = figure.subplots(1, len(views), squeeze=False)[0]
    colors = ListedColormap(colormaps["viridis"](np.linspace(BRIGHTEST, 0, 256)))
    look = {"cmap": colors, "vmin": 0, "vmax": scene.reach * scene.frame.diameter, "linewidths": 0}
    target = thinned(scene.target, POINTS) @ view.T
    for panel, (title, cloud) in zip(panels, views, strict=True):
        source = thinned(cloud, POINTS)
        order = np.argsort((source @ view.T)[:, 2], kind="stable")  # from back to front
        far = cKDTree(scene.target).query(source)[0][order] * scene.frame.diameter
        ahead = (source @ view.T)[order]
        panel.scatter(target[:, 0], target[:, 1], s=1, c=style.LIGHT_GRAY, linewidths=0)
        shown = panel.scatter(ahead[:, 0], ahead[:, 1], s=2, c=far, **look)
        panel.set(aspect="equal", xlim=corners_2_2[0], ylim=corners_2_2[1])
        panel.set_axis_off()
        panel.set_title(title)
    label = f"distance to the target ({unit})"
    bar = figure.colorbar(shown, ax=panels, location="bottom", shrink=0.5, aspect=50, extend="max", label=label)
    bar.outline.set_linewidth(0.4)


def _draw_causes(panel, explanation: Explanation) -> None:
    shares, variances = explanation.diagnosis.causes, explanation.diagnosis.variances
    share_C, deviation_C = np.array([*shares.values()]), np.sqrt([variances[name] for name in shares])
    spread_2_C = np.stack([np.minimum(deviation_C, share_C), np.minimum(deviation_C, 1 - share_C)])
    colors = [style.CONCEPT_COLORS.get(name, style.LIGHT_GRAY) for name in shares]
    place_C = np.arange(len(shares))[::-1]
    panel.barh(place_C, share_C, xerr=spread_2_C, color=colors, height=0.6, error_kw={"elinewidth": 0.8})
    panel.set_yticks(place_C, [*shares])
    panel.set(xlim=(0, 1.02), xlabel="probability, if it failed", title="causes")


def _draw_what_ifs(panel, scene: Scene, unit: str) -> None:
    errors = [scene.frame.diameter * scene.possibilities[0].errors[subset] for subset in ROWS]
    panel.barh(np.arange(len(errors)), errors, color=style.BLUE, height=0.6)
    limit = scene.limit * scene.frame.diameter
    panel.axvline(limit, color=style.VERMILION, linewidth=0.8)
    label = {"color": style.VERMILION, "fontsize": style.SMALL_PT, "va": "center"}
    label["ha"] = "left" if limit < max(errors) / 2 else "right"
    panel.text(limit, len(errors) - 0.3, " tolerance ", **label)
    words = ["with all three" if not SUBSETS[subset] else taken_out(subset, WITHOUT).lower() for subset in ROWS]
    panel.set_yticks(np.arange(len(errors)), words)
    panel.set(xlabel=f"re-enacted error ({unit})", title="error that would remain", ylim=(-0.5, len(errors) + 0.1))


def _lines(explanation: Explanation) -> list[str]:
    lines = [(line[:10].strip(), line[10:]) for line in replace(explanation, repaired=None).lines()]
    shown = [f"{label}: {text}" for label, text in lines if label in SHOWN or label.endswith("set")]
    return shown + [f"warning: {warning}" for warning in explanation.warnings]
