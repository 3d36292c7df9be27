"""Draws Fig. 2 of the paper, GP-CA at a glance, from one registration of the run and the results of every stage."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.errors import InputError
from gpca.experiments.method.shown_sample import Stages, draw_embedding, draw_scores_with_numbers
from gpca.experiments.recovery_example import short_action
from gpca.pairs.perturbation import CONCEPTS
from gpca.recovery.policy import NOTHING, QUEUE, Decision, RecoveryPolicy
from gpca.reporting.figures.cloud_views import draw_clouds
from gpca.reporting.figures.diagram import Canvas
from gpca.reporting.figures.style import (
    BLACK,
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
THRESHOLD: dict[str, Any] = {"color": BLACK, "linestyle": (0, (3, 2)), "linewidth": 0.8}  # the look of its line


def draw_overview(
    registrations_npz: str | Path,
    embeddings_npz: str | Path,
    predictions_csv: str | Path,
    uncertainty_csv: str | Path,
    limits: Mapping[str, float],
    title: str,
    encoder: str,
    treatments: Mapping[str, str],
    thresholds: Mapping[str, float | None],
    dataset: str = "",
) -> Figure:
    """Draw the results of all stages for one registration, from its clouds to the decision that follows.

    The figure shows the clouds before and after ICP, the embedding, the scores ± their deviations, and BALD among all
    test samples. What follows is what the policy decides from what GP-CA knows, the uncertainty u, the scores and BALD:
    the action against the concept named, or a question to a person and a new training. Dashed are the thresholds.

    Args:
        treatments: The action of recovery for each concept.
        thresholds: Those of the policy of recovery; `uncertain`, where null, is chosen on the test samples.
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
    scores = canvas.panel(2.58, 0.36, 0.42, 0.56)
    draw_scores_with_numbers(scores, sample)
    canvas.text(2.79, 0.02, r"scores $\hat{s}_c \pm \sqrt{v_c}$", va="bottom")

    bald_N = stages.predictions.loc[stages.predictions["split"] == "test", "bald"].to_numpy()
    policy = RecoveryPolicy.of_settings(thresholds, treatments, 1, bald_N)
    limit, action = policy.thresholds.uncertain, decide(stages, row, policy).action
    scores.axvline(policy.thresholds.dominant, **THRESHOLD)
    _draw_bald(canvas.panel(1.26, 0.36, 0.72, 0.48), bald_N, float(sample["bald"]), limit)
    canvas.text(1.58, 0.02, f"BALD: ask above {limit:.2f} nats", va="bottom")
    canvas.arrow((2.2, 0.6), (2.02, 0.6))
    acts, asks = action not in (NOTHING, QUEUE), action == QUEUE
    canvas.arrow((1.22, 0.6), (0.96, 0.6), words="low", color=GRAY if asks else BLUE)
    follows = f"Act on {named}:\n{short_action(treatments[named])}"
    if action == NOTHING:
        follows = "No action:\n$u$ is that of\na clean pair"
    canvas.box(0.02, 0.32, 0.92, 0.56, follows, CONCEPT_COLORS[named] if acts else GRAY, dashed=asks)
    canvas.arrow((1.62, 0.88), (1.62, 1.08), color=BLUE if asks else GRAY)
    canvas.text(1.66, 0.97, "high", ha="left", va="center")
    canvas.box(
        0.02,
        1.08,
        1.9,
        0.37,
        "Ask a person for the concept\nof a few such cases",
        BLUE if asks else GRAY,
        dashed=not asks,
    )
    canvas.arrow((1.92, 1.265), (2.22, 1.265), words="retrain")

    write_title(canvas.figure, f"{title}: {object_in_words(sample['object'], dataset)}")
    for x_in, color, words in ((0.06, TARGET_COLOR, "target"), (0.5, SOURCE_COLOR, "source")):
        canvas.dot(x_in, 2.74, color, words)
    return canvas.figure


def decide(stages: Stages, row: int, policy: RecoveryPolicy) -> Decision:
    """Return the branch of a row by what GP-CA knows of it, never by how far off its pose truly is.

    Nothing is done where its uncertainty u is one that 95 % of the clean pairs have; else the policy decides.
    """
    if stages.u_S[row] <= stages.u_clean:
        return Decision(NOTHING, "", f"u {stages.u_S[row]:.1f} is that of a clean pair")
    sample = stages.predictions.iloc[row]
    return policy.decide(np.array([float(sample[f"score_{name}"]) for name in CONCEPTS]), float(sample["bald"]))


def _draw_bald(axes, bald_N: np.ndarray, of_sample: float, limit: float) -> None:
    """Draw how BALD is spread over the test samples, where the sample stands, and the threshold."""
    axes.hist(bald_N, bins=12, color=LIGHT_GRAY)
    axes.axvline(of_sample, color=BLUE, linewidth=1.2)
    axes.axvline(limit, **THRESHOLD)
    axes.set(yticks=[])
    axes.set_xlim(left=0)
    axes.spines["left"].set_visible(False)
    axes.tick_params(pad=1.5, length=2)
    axes.locator_params(axis="x", nbins=3)
    axes.margins(y=0)
