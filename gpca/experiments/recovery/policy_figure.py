"""Draws Fig. 6 of the paper: from concept scores and their uncertainty to one of four branches, with their limits."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.reporting.figures.diagram import Canvas
from gpca.reporting.figures.style import CONCEPT_COLORS, GRAY, TEXT_WIDTH_IN, write_title
from gpca.reporting.words import in_words, plural

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WORDS = {
    "reinitialize": "Reinitialize ICP\nbroader search over orientations",
    "new_view": "Change the viewpoint\nmore of the surface in sight",
    "denoise": "Filter, check the sensor\nseveral frames, outliers removed",
}
ASKED = {
    "noise": "noise dominates",
    "pose": "pose dominates",
    "overlap": "overlap dominates",
}


def draw_mitigation(title: str, policy_json: str | Path) -> Figure:
    """Draw the mapping of one policy: its inputs, its branches in the order of the tests, and the ways back.

    An action leads to new scores; a queued case leads to a label and to a classifier that has learned it.
    """
    policy = json.loads(Path(policy_json).read_text(encoding="utf-8"))
    limits, treatments = policy["thresholds"], policy["treatments"]
    canvas = Canvas(TEXT_WIDTH_IN, 2.62)
    write_title(canvas.figure, f"{title}: thresholds of this run")
    words = "GP-CA\n" + r"scores $\hat{s}_c$, variances $v_c$," + "\nBALD"
    canvas.box(0.04, 0.86, 1.3, 0.66, words)
    branches = [(_queue_condition(limits), "Abstain\nqueue for a person", GRAY)]
    branches += [
        (ASKED.get(concept, concept), WORDS.get(action, in_words(action)), CONCEPT_COLORS[concept])
        for concept, action in sorted(treatments.items(), key=lambda item: ("pose", "overlap", "noise").index(item[0]))
    ]
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
    """Return the words for an action of recovery, its purpose left out."""
    return WORDS.get(action, in_words(action)).splitlines()[0].rstrip(",")


def _queue_condition(limits: Mapping[str, float]) -> str:
    return (
        f"BALD > {limits['uncertain']:.3f} nats\nor " + rf"$\mathrm{{max}}_c\,\hat{{s}}_c$ < {limits['dominant']:.2f}"
    )
