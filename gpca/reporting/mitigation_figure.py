"""Fig. 6 of the paper: from concept scores and their uncertainty to one of four branches, with the policy's numbers."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from gpca.errors import InputError
from gpca.reporting.frame_views import COLOURS
from gpca.reporting.style import TEXT_WIDTH_IN, save_figure, use_style

GREY = "#666666"
WORDS = {
    "reinitialise": "Reinitialise ICP\nbroader search over orientations",
    "new_view": "Change the viewpoint\nmore of the surface in sight",
    "denoise": "Filter, check the sensor\nseveral frames, outliers removed",
}
ASKED = {
    "noise": "noise dominates",
    "pose": "pose dominates",
    "overlap": "overlap dominates",
}


def read_policy(path: str | Path) -> dict:
    """Read the JSON of the step ``recover``; InputError where it is missing or lacks a threshold."""
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
        content["thresholds"] = {
            name: float(content["thresholds"][name]) for name in ("uncertain", "dominant", "improvement", "attempts")
        }
        content["treatments"] = dict(content["treatments"])
    except FileNotFoundError as fault:
        raise InputError(path, "no such file", "make it with 'python -m gpca recover'") from fault
    except (ValueError, KeyError, TypeError) as fault:
        raise InputError(path, "is no policy with its thresholds", "make it with 'python -m gpca recover'") from fault
    return content


def draw_mitigation(policy_json: str | Path, pdf_path: str | Path, png_path: str | Path) -> None:
    """Draw the mapping of one policy: what it reads, the four branches in the order of asking, and the way back."""
    policy = read_policy(policy_json)
    limits, treatments = policy["thresholds"], policy["treatments"]
    use_style()
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(TEXT_WIDTH_IN, 2.3))
    axes.set(xlim=(0, 100), ylim=(0, 40))
    axes.set_axis_off()
    figure.subplots_adjust(0.005, 0.01, 0.995, 0.99)
    _box(axes, 0.5, 14, 17, 12, "GP-CA\n" + r"scores $\hat{s}_c$, variances $v_c$," + "\nBALD", GREY)
    axes.text(0.5, 39, "Thresholds of this run, on virtual\ntables (procedural stand-in)", va="top", fontsize=7)
    branches = [(_queue_condition(limits), "Abstain\nqueue for labelling, retrain", GREY)]
    branches += [
        (rf"{ASKED.get(concept, concept)}", WORDS.get(action, action.replace("_", " ")), COLOURS[concept])
        for concept, action in sorted(treatments.items(), key=lambda item: ("pose", "overlap", "noise").index(item[0]))
    ]
    for place, (condition, branch, colour) in enumerate(branches):
        y = 32.5 - 9.2 * place
        _box(axes, 29, y, 25, 7, condition, colour, dashed=True)
        _box(axes, 61, y, 26, 7, branch, colour)
        _arrow(axes, (17.5, 20), (29, y + 3.5), GREY)
        _arrow(axes, (54, y + 3.5), (61, y + 3.5), colour)
        if place:
            axes.plot([87, 91], [y + 3.5] * 2, color=GREY, linewidth=0.8)
    axes.plot([91, 91, 9, 9], [26.8, 1.2, 1.2, 10], color=GREY, linewidth=0.8, clip_on=False)
    _arrow(axes, (9, 9), (9, 14), GREY)
    axes.plot([91, 91], [8.4, 26.8], color=GREY, linewidth=0.8)
    back = (
        "register and score anew\n"
        rf"fall of $\hat{{s}}_c$ below {limits['improvement']:.2f}:" + "\nnext concept; after "
        f"{limits['attempts']:.0f} such\nattempts: queue"
    )
    axes.text(92, 17.6, back, va="center", ha="left", rotation=90, fontsize=6, linespacing=1.1)
    save_figure(figure, pdf_path, png_path)


def short_action(action: str) -> str:
    """Return the words for an action of recovery, its purpose left out."""
    return WORDS.get(action, action.replace("_", " ")).splitlines()[0].rstrip(",")


def _queue_condition(limits: Mapping[str, float]) -> str:
    return f"BALD > {limits['uncertain']:.3f} nats\nor " + rf"$\max_c\,\hat{{s}}_c$ < {limits['dominant']:.2f}"


def _box(axes, x: float, y: float, width: float, height: float, text: str, colour: str, dashed: bool = False) -> None:
    from matplotlib.patches import FancyBboxPatch

    axes.add_patch(
        FancyBboxPatch(
            (x, y),
            width,
            height,
            boxstyle="round,pad=0,rounding_size=1",
            facecolor="white" if dashed else colour + "22",
            edgecolor=colour,
            linewidth=0.9,
            linestyle="--" if dashed else "-",
        )
    )
    axes.text(x + width / 2, y + height / 2, text, ha="center", va="center", fontsize=7, linespacing=1.15)


def _arrow(axes, start: tuple[float, float], end: tuple[float, float], colour: str) -> None:
    axes.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 0.8, "mutation_scale": 7})
