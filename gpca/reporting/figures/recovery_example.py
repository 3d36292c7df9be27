"""Draws Fig. 1 of the paper: one failure of the run, attributed to a concept, seen from a new viewpoint, and solved."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gpca.alignment.pose_error import CORRECT
from gpca.alignment.rigid import transform
from gpca.arrays import load_arrays
from gpca.objects.title import STAND_IN
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures.frame_views import draw_score_bars
from gpca.reporting.figures.style import TARGET_COLOUR, TEXT_WIDTH_IN, YELLOW, save_figure, use_style, write_title
from gpca.reporting.words import in_words

SHAPES: dict[str, tuple[int | str, ...]] = {
    "camera_3_3": (3, 3),
    "model_m": ("Q", 3),
    "object": (),
    "cause": (),
    "action": (),
    "scores": (len(CONCEPTS),),
    "errors": (2,),
    **{f"image_{view}": ("H", "W", 3) for view in ("first", "next")},
    **{f"mask_{view}": ("H", "W") for view in ("first", "next")},
    **{f"T_camera_object_{view}": (4, 4) for view in ("first", "next")},
}


def draw_recovery_example(example_npz: str | Path, pdf_path: str | Path, png_path: str | Path) -> None:
    """Draw (a) the first view with the model where ICP put it, (b) the concept scores, (c, d) the new view.

    The last panel shows the new view once more, with the model where ICP put it then.

    Raises:
        InputError: an unusable file.
    """
    found = load_arrays(example_npz, SHAPES, "python -m gpca recover")
    use_style()
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(TEXT_WIDTH_IN, 1.78))
    panels = [figure.add_axes((left, 0.13, 0.245, 0.74)) for left in (0.003, 0.497, 0.751)]
    scores = figure.add_axes((0.325, 0.33, 0.15, 0.5))
    for panel, view, posed in zip(panels, ("first", "next", "next"), (True, False, True), strict=True):
        panel.imshow(found[f"image_{view}"], alpha=0.75 if posed else 1.0)
        if posed:
            seen = transform(found[f"T_camera_object_{view}"], found["model_m"]) @ found["camera_3_3"].T
            ahead = seen[:, 2] > 0.05  # Points nearer to the camera than this, in metres, are left out.
            u, v = (seen[ahead, :2] / seen[ahead, 2:]).T
            panel.scatter(u, v, s=0.6, color=TARGET_COLOUR, linewidths=0)
        else:
            panel.contour(found[f"mask_{view}"], [0.5], colors=YELLOW, linewidths=0.9)
        height, width = found[f"mask_{view}"].shape
        panel.set(xlim=(0, width - 1), ylim=(height - 1, 0))
        panel.set_axis_off()
    shown = found["scores"]
    draw_score_bars(scores, shown.tolist(), str(found["cause"]))
    scores.set(xlim=(min(0, shown.min()), max(1, shown.max())))
    scores.set_xlabel("score", labelpad=1)
    before, after = (100 * error for error in found["errors"])
    solved = "solved" if after <= 100 * CORRECT else "not solved"
    captions = (
        f"(a) Occluded: pose {before:.0f} % $d$ off" if str(found["cause"]) == "overlap" else f"(a) {before:.0f} % off",
        f"(b) Attributed to {CONCEPTS[int(np.argmax(shown))]}{_instead(str(found['action']))}",
        "(c) New viewpoint",
        f"(d) After it: {after:.1f} % $d$ off, {solved}",
    )
    for centre, caption in zip((0.1255, 0.395, 0.6195, 0.8735), captions, strict=True):
        figure.text(centre, 0.02, caption, ha="center", va="bottom")
    name = in_words(found["object"])
    write_title(figure, f"Tables of the virtual depth camera ({STAND_IN}): {name}; dots: model where ICP put it")
    save_figure(figure, pdf_path, png_path)


def _instead(action: str) -> str:
    """Return what the policy did where it did not change the viewpoint, as the panels show it."""
    return "" if action == "new_view" else f" ({in_words(action)})"
