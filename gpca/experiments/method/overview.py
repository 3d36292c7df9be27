"""Draws Fig. 2 of the paper, GP-CA at a glance, from one registration of the run and the results of every stage."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.causes.truth import FAILED
from gpca.errors import InputError
from gpca.experiments.method.shown_sample import Stages, draw_embedding, draw_scores_with_numbers
from gpca.experiments.recovery.figures import short_action
from gpca.reporting.figures.cloud_views import draw_clouds
from gpca.reporting.figures.diagram import Canvas
from gpca.reporting.figures.style import (
    BLUE,
    COLUMN_WIDTH_IN,
    CONCEPT_COLORS,
    GRAY,
    LIGHT_GRAY,
    SOURCE_COLOR,
    TARGET_COLOR,
    write_title,
)
from gpca.reporting.words import object_in_words

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CONCEPT = "pose"  # The sample shown is of this concept, since before and after ICP differ to the eye.
CAPTIONS = {"init": "initial", "icp": "aligned"}


def draw_overview(
    registrations_npz: str | Path,
    embeddings_npz: str | Path,
    predictions_csv: str | Path,
    uncertainty_csv: str | Path,
    limits: Mapping[str, float],
    title: str,
    encoder: str,
    treatments: Mapping[str, str],
    dataset: str = "",
) -> Figure:
    """Draw the results of all stages for one registration, from its clouds to the decision that follows.

    The figure shows the clouds before and after ICP, the embedding, the scores ± their deviations, and BALD among all
    test samples. What follows is the action against the concept named, if the registration failed, or a question to a
    person and a new training.

    Args:
        treatments: The action of recovery for each concept.
    """
    stages = Stages.load(registrations_npz, embeddings_npz, predictions_csv, uncertainty_csv, limits)
    row = stages.choose(CONCEPT, registrations_npz)
    sample = stages.predictions.iloc[row]
    if (named := sample["concept_predicted"]) not in treatments:
        raise InputError("recovery.treatments", f"has no action for '{named}'", "name one in the config")
    canvas = Canvas(COLUMN_WIDTH_IN, 2.95)

    seen = stages.seen(row)
    corners = np.concatenate([np.concatenate(pair) for pair in seen.values()])
    for left_in, (which, pair) in zip((0.02, 1.42), seen.items(), strict=True):
        draw_clouds(canvas.panel(left_in, 1.78, 1.08, 0.92), *pair, 1.0, (corners.min(axis=0), corners.max(axis=0)))
        canvas.text(left_in + 0.54, 1.74, f"{CAPTIONS[which]}: {stages.words(row, which)}", va="top")
    canvas.arrow((1.12, 2.24), (1.40, 2.24), words="ICP")
    canvas.arrow((2.52, 2.24), (2.96, 2.24), words=encoder)
    draw_embedding(canvas.panel(3.02, 1.86, 0.42, 0.76), stages.h_S_d[row])
    canvas.text(3.23, 1.74, rf"$\mathbf{{h}} \in \mathbb{{R}}^{{{stages.h_S_d.shape[1]}}}$", va="top")

    canvas.box(2.22, 1.14, 1.26, 0.25, "GP classifier", BLUE)
    canvas.arrow((3.23, 1.56), (3.23, 1.39))
    canvas.arrow((2.79, 1.14), (2.79, 0.97))
    draw_scores_with_numbers(canvas.panel(2.58, 0.36, 0.42, 0.56), sample)
    canvas.text(2.79, 0.02, r"scores $\hat{s}_c \pm \sqrt{v_c}$", va="bottom")

    bald = stages.predictions.loc[stages.predictions["split"] == "test", "bald"]
    _draw_bald(canvas.panel(1.26, 0.36, 0.72, 0.48), bald.to_numpy(), float(sample["bald"]))
    canvas.text(1.62, 0.02, "BALD (nats)", va="bottom")
    canvas.arrow((2.2, 0.6), (2.02, 0.6))
    canvas.arrow((1.22, 0.6), (0.96, 0.6), words="low")
    # GP-CA always names a concept; acting on it makes sense only where something is wrong.
    failed = stages.state(row) == FAILED
    follows = (
        f"Act on {named}:\n{short_action(treatments[named])}" if failed else f"No action on\n{named}: it did\nnot fail"
    )
    canvas.box(0.02, 0.32, 0.92, 0.56, follows, CONCEPT_COLORS[named] if failed else GRAY)
    canvas.arrow((1.62, 0.88), (1.62, 1.08))
    canvas.text(1.66, 0.97, "high", ha="left", va="center")
    canvas.box(0.02, 1.08, 1.9, 0.37, "Ask a person for the concept\nof a few such cases", GRAY, dashed=True)
    canvas.arrow((1.92, 1.265), (2.22, 1.265), words="retrain")

    write_title(canvas.figure, f"{title}: {object_in_words(sample['object'], dataset)}")
    for x_in, color, words in ((0.06, TARGET_COLOR, "target"), (0.5, SOURCE_COLOR, "source")):
        canvas.dot(x_in, 2.74, color, words)
    return canvas.figure


def _draw_bald(axes, bald_N: np.ndarray, of_sample: float) -> None:
    """Draw how BALD is spread over the test samples, with a line where the sample stands."""
    axes.hist(bald_N, bins=12, color=LIGHT_GRAY)
    axes.axvline(of_sample, color=BLUE, linewidth=1.2)
    axes.set(yticks=[])
    axes.set_xlim(left=0)
    axes.spines["left"].set_visible(False)
    axes.tick_params(pad=1.5, length=2)
    axes.locator_params(axis="x", nbins=3)
    axes.margins(y=0)
