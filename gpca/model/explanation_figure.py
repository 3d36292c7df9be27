"""Draws one explanation in one look: both clouds, the causes, what would have been without them, and what to do."""

from pathlib import Path
from textwrap import fill, wrap

import numpy as np

from gpca.causes.truth import BY_SIZE
from gpca.model.explanation import Explanation
from gpca.model.scene import taken_out
from gpca.numerals import in_decimals
from gpca.reporting.figures import style
from gpca.reporting.figures.cloud_views import thinned, widest_views
from gpca.rigid import transform

HEIGHT_IN = 5.0
POINTS = 1500  # of each cloud; more hide one another
BRIGHTEST = 0.8  # of viridis; what is brighter is lost on white
LETTERS = 40  # in a line of text
MOST_LINES = 14


def draw_explanation(explanation: Explanation, png_path: str | Path, names: str = "") -> None:
    """Write one explanation as a PNG of 300 dpi; `names` of the files are its title.

    Raises ValueError for an explanation without a scene.
    """
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap
    from scipy.spatial import cKDTree

    if (scene := explanation.scene) is None:
        raise ValueError("an explanation that came as one of many has no clouds to draw")
    diagnosis = explanation.diagnosis
    figure = style.use_style().figure(figsize=(style.TEXT_WIDTH_IN, HEIGHT_IN), layout="constrained")
    above, below = figure.subfigures(2, 1, height_ratios=(1.15, 1))
    views = [("before", scene.source), ("after", scene.aligned)]
    if diagnosis and not explanation.unknown:
        poses = zip(diagnosis.reenacted.poses, scene.possibilities, strict=True)
        for other in [possibility for pose, possibility in poses if not pose.registered][:1]:  # the most probable
            views.append((f"another pose (probability {other.probability:.2f})", transform(other.T, scene.source)))
    panels = above.subplots(1, len(views), squeeze=False)[0]
    view = widest_views(scene.target)[0]
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
        panel.set(aspect="equal")
        panel.set_axis_off()
        panel.set_title(title)
    label = f"distance to the target ({explanation.unit})"
    bar = above.colorbar(shown, ax=panels, location="right", shrink=0.8, extend="max", label=label)
    bar.outline.set_linewidth(0.4)
    left, middle, right = below.subplots(1, 3)
    # Without a diagnosis, the scores of GP-CA stand for the probabilities of the causes.
    shares = diagnosis.causes if diagnosis else explanation.scores
    variances = diagnosis.variances if diagnosis else explanation.variances
    deviations = [float(np.sqrt(variances[name])) for name in shares]
    bar_colors = [style.CONCEPT_COLORS.get(name, style.LIGHT_GRAY) for name in shares]
    bars = {"xerr": deviations, "color": bar_colors, "height": 0.6, "error_kw": {"elinewidth": 0.8}}
    left.barh(np.arange(len(shares))[::-1], [*shares.values()], **bars)
    effects = diagnosis.reenacted.effects if diagnosis else {}
    added = {name: f"\n{in_decimals(effect)} {explanation.unit}" for name, effect in effects.items()}
    labels = [f"{name}{added.get(name, '')}" for name in shares]
    left.set_yticks(np.arange(len(shares))[::-1], labels)
    left.set(xlim=(0, 1), xlabel="probability", title="causes, if it failed, and what each adds")
    if scene.possibilities:
        errors = [scene.frame.diameter * scene.possibilities[0].errors[subset] for subset in BY_SIZE]
        middle.barh(np.arange(len(errors)), errors, color=style.BLUE, height=0.6)
        middle.axvline(scene.limit * scene.frame.diameter, color=style.VERMILION, linewidth=0.8)
        middle.set_yticks(np.arange(len(errors)), [fill(taken_out(subset), 26) for subset in BY_SIZE])
        middle.set(xlabel=f"re-enacted error ({explanation.unit})", title="what if?")
    else:
        middle.set_axis_off()
    if explanation.unknown:
        lines = ["state: unknown"]
    elif diagnosis is None:
        lines = [f"leading concept: {explanation.concept}"]
    else:
        lines = [f"{diagnosis.state}: {diagnosis.statement}"]
        tolerance = f"{in_decimals(diagnosis.tolerance)} {explanation.unit}"
        lines.append(f"off by more than {tolerance} with probability {diagnosis.result:.2f}")
        lines += [" ".join(line.split()) for line in (diagnosis.guarantee.lines() if diagnosis.guarantee else [])]
    lines.append(f"action: {explanation.advice} ({explanation.reason})")
    lines += [f"warning: {warning}" for warning in explanation.warnings]
    wrapped = [part for line in lines for part in wrap(line, LETTERS, subsequent_indent="   ")]
    text = "\n".join(wrapped[:MOST_LINES] + ["…"] * (len(wrapped) > MOST_LINES))
    text_look = {"va": "top", "ha": "left", "fontsize": style.SMALL_PT, "linespacing": 1.4, "in_layout": False}
    right.set_axis_off()
    right.text(0, 1, text, transform=right.transAxes, parse_math=False, **text_look)
    style.write_title(figure, names)
    style.save_png(figure, png_path)
