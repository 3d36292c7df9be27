"""Draws one explanation in one look: both clouds, the causes, what would have been without them, and what to do."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill, wrap

import numpy as np

from gpca.alignment.rigid import transform
from gpca.causes.truth import BY_SIZE
from gpca.model.explanation import Explanation
from gpca.model.scene import Scene, distances, taken_out
from gpca.reporting.figures.cloud_views import thinned, widest_views
from gpca.reporting.figures.style import (
    BLUE,
    CONCEPT_COLORS,
    LIGHT_GRAY,
    SMALL_PT,
    TEXT_WIDTH_IN,
    VERMILION,
    save_png,
    use_style,
    write_title,
)

HEIGHT_IN = 5.0
POINTS = 1500  # of each cloud; more hide one another
BRIGHTEST = 0.8  # of viridis; what is brighter is lost on white
LETTERS = 40  # in a line of text
MOST_LINES = 14


def draw_explanation(explanation: Explanation, png_path: str | Path, names: str = "") -> None:
    """Write one explanation as a PNG of 300 dpi.

    Args:
        explanation: with its scene, as :meth:`gpca.model.explainer.Explainer.explain` returns it.
    """
    if (scene := explanation.scene) is None:
        raise ValueError("an explanation that came as one of many has no clouds to draw")
    figure = use_style().figure(figsize=(TEXT_WIDTH_IN, HEIGHT_IN), layout="constrained")
    above, below = figure.subfigures(2, 1, height_ratios=(1.15, 1))
    views = [("before", scene.source), ("after", scene.aligned), *_another(explanation, scene)]
    panels = above.subplots(1, len(views), squeeze=False)[0]
    view = widest_views(scene.target)[0]
    for panel, (title, source) in zip(panels, views, strict=True):
        shown = _draw_clouds(panel, scene, source, view)
        panel.set_title(title)
    label = f"distance to the target ({explanation.unit})"
    bar = above.colorbar(shown, ax=panels, location="right", shrink=0.8, extend="max", label=label)
    bar.outline.set_linewidth(0.4)
    left, middle, right = below.subplots(1, 3)
    _draw_causes(left, explanation)
    _draw_what_ifs(middle, scene, explanation.unit)
    _write(right, explanation)
    write_title(figure, names)
    save_png(figure, png_path)


def _another(explanation: Explanation, scene: Scene) -> list[tuple[str, np.ndarray]]:
    """Return the most probable pose that is not the result, as a title and the source there; none where all are."""
    reenacted = explanation.diagnosis.reenacted if explanation.diagnosis and not explanation.unknown else None
    poses = zip(reenacted.poses, scene.possibilities, strict=True) if reenacted else ()
    others = [possibility for pose, possibility in poses if not pose.registered]
    if not others:
        return []
    title = f"another pose (probability {others[0].probability:.2f})"
    return [(title, transform(others[0].T, scene.source))]


def _draw_clouds(panel, scene: Scene, source: np.ndarray, view: np.ndarray):
    """Draw the target in gray and the source by its distances, from back to front; return what has the colors."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    colors = ListedColormap(colormaps["viridis"](np.linspace(BRIGHTEST, 0, 256)))
    target, source = thinned(scene.target, POINTS), thinned(source, POINTS)
    at, ahead = target @ view.T, source @ view.T
    panel.scatter(at[:, 0], at[:, 1], s=1, c=LIGHT_GRAY, linewidths=0)
    order = np.argsort(ahead[:, 2], kind="stable")
    reach = scene.reach * scene.frame.diameter
    far = distances(source, scene.target)[order] * scene.frame.diameter
    look = {"cmap": colors, "vmin": 0, "vmax": reach, "linewidths": 0}
    shown = panel.scatter(ahead[order, 0], ahead[order, 1], s=2, c=far, **look)
    panel.set(aspect="equal")
    panel.set_axis_off()
    return shown


def _draw_causes(panel, explanation: Explanation) -> None:
    """Draw the probability of each cause with its standard deviation; without a diagnosis, GP-CA's scores."""
    diagnosis = explanation.diagnosis
    shares = diagnosis.causes if diagnosis else explanation.scores
    variances = diagnosis.variances if diagnosis else explanation.variances
    places = np.arange(len(shares))[::-1]
    deviations = [float(np.sqrt(variances[name])) for name in shares]
    colors = [CONCEPT_COLORS.get(name, LIGHT_GRAY) for name in shares]
    panel.barh(places, [*shares.values()], xerr=deviations, color=colors, height=0.6, error_kw={"elinewidth": 0.8})
    effects = diagnosis.reenacted.effects if diagnosis else {}
    labels = [f"{name}\n{effects[name]:+.2g} {explanation.unit}" if name in effects else name for name in shares]
    panel.set_yticks(places, labels)
    panel.set(xlim=(0, 1), xlabel="probability", title="causes, if it failed, and what each adds")


def _draw_what_ifs(panel, scene: Scene, unit: str) -> None:
    """Draw the mean error of the registrations that were re-enacted under the most probable pose."""
    if not scene.possibilities:
        panel.set_axis_off()
        return
    errors = [scene.frame.diameter * scene.possibilities[0].errors[subset] for subset in BY_SIZE]
    places = np.arange(len(errors))
    panel.barh(places, errors, color=BLUE, height=0.6)
    panel.axvline(scene.limit * scene.frame.diameter, color=VERMILION, linewidth=0.8)
    labels = [fill(taken_out(subset), 26) for subset in BY_SIZE]
    panel.set_yticks(places, labels)
    panel.set(xlabel=f"re-enacted error ({unit})", title="what if?")


def _write(panel, explanation: Explanation) -> None:
    """Write what was found, what is promised and what to do."""
    panel.set_axis_off()
    diagnosis = explanation.diagnosis
    if explanation.unknown:
        lines = ["state: unknown"]
    elif diagnosis is None:
        lines = [f"leading concept: {explanation.concept}"]
    else:
        lines = [f"{diagnosis.state}: {' and '.join(diagnosis.named) or 'nothing is wrong'}"]
        lines.append(f"probability of failure {diagnosis.failure:.2f}")
        lines += [" ".join(line.split()) for line in (diagnosis.guarantee.lines() if diagnosis.guarantee else [])]
    lines.append(f"action: {explanation.advice} ({explanation.reason})")
    lines += [f"warning: {warning}" for warning in explanation.warnings]
    wrapped = [part for line in lines for part in wrap(line, LETTERS, subsequent_indent="   ")]
    text = "\n".join(wrapped[:MOST_LINES] + ["…"] * (len(wrapped) > MOST_LINES))
    panel.text(
        0, 1, text, va="top", ha="left", fontsize=SMALL_PT, transform=panel.transAxes, linespacing=1.4, in_layout=False
    )
