"""Draws Fig. 4 of the paper, online inference (top) and active learning (bottom), from what a run wrote."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.active_learning.settings import ActiveLearningSettings
from gpca.errors import InputError
from gpca.evaluation.measures import source_method_seed
from gpca.experiments.label_curves import STYLES, mean_curves
from gpca.experiments.method.label_round import SETTING, Round, first_round
from gpca.experiments.method.shown_sample import Stages, draw_embedding, draw_scores_with_numbers
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures.cloud_views import draw_clouds, thinned
from gpca.reporting.figures.diagram import Canvas
from gpca.reporting.figures.style import (
    BLACK,
    BLUE,
    CONCEPT_COLORS,
    CONCEPT_MARKERS,
    GRAY,
    LIGHT_GRAY,
    SMALL_PT,
    SOURCE_COLOR,
    TARGET_COLOR,
    TEXT_WIDTH_IN,
    blues,
    write_title,
)
from gpca.reporting.words import object_in_words

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

# Above stands a sample of the first of these of which a registration failed, below the first that was held out.
ORDER = ("overlap", "pose", "noise")
TITLES = {"bald_kmeans": "BALD + $k$-means", "random": "random"}  # The figure draws the curves of these strategies.
THUMBNAILS = 6  # The figure shows this many clouds of the pool.


def draw_pipeline(
    registrations_npz: str | Path,
    embeddings_npz: str | Path,
    predictions_csv: str | Path,
    uncertainty_csv: str | Path,
    limits: Mapping[str, float],
    curve_files: Iterable[str | Path],
    title: str,
    encoder: str,
    active_learning: Mapping,
    dataset: str = "",
) -> Figure:
    """Draw the stages from clouds to scores of one sample, and one round of active learning with its learning curve.

    Args:
        curve_files: The files of that source, named as for
            :func:`gpca.experiments.label_curves.mean_curves`.
        active_learning: The config's section; the figure repeats the first round of the run.
    """
    stages = Stages.load(registrations_npz, embeddings_npz, predictions_csv, uncertainty_csv, limits)
    row = stages.choose(ORDER[0], registrations_npz, *ORDER[1:])
    files = list(curve_files)
    new, curves = _curves(files)
    source, _, seed = source_method_seed(files[0])
    labeling = first_round(stages, new, ActiveLearningSettings.from_dict(dict(active_learning)), source, seed)
    canvas = Canvas(TEXT_WIDTH_IN, 3.5)
    canvas.box(0.03, 1.9, 7.1, 1.4, color=LIGHT_GRAY)
    canvas.box(0.03, 0.03, 7.1, 1.6, color=LIGHT_GRAY)
    _draw_inference(canvas, stages, row, encoder, labeling)
    _draw_active_learning(canvas, stages, labeling, new, curves)
    canvas.arrow((6.4, 1.97), (6.4, 1.63))
    canvas.text(6.36, 1.765, "uncertain cases", ha="right", va="center")
    canvas.arrow((0.9, 1.63), (0.9, 1.74), (4.62, 1.74), (4.62, 2.0))
    canvas.text(2.76, 1.775, "retrained classifier", va="bottom")
    write_title(canvas.figure, f"{title}: {object_in_words(stages.predictions['object'][row], dataset)}")
    canvas.dot(6.15, 3.4, TARGET_COLOR, r"target $\mathcal{Q}$", gap_in=0.05)
    canvas.dot(6.63, 3.4, SOURCE_COLOR, r"source $\mathcal{P}$", gap_in=0.05)
    return canvas.figure


def _curves(files: list[str | Path]) -> tuple[str, dict[str, pd.DataFrame]]:
    """Return the concept that was new, and the learning curves of that experiment by strategy."""
    for concept in ORDER:
        curves = {name: one for (_, name, setting), one in mean_curves(files, [concept]).items() if setting == SETTING}
        if any(name in curves for name in TITLES):
            return concept, curves
    raise InputError("active learning", f"has no curve of {' or '.join(TITLES)}", "run one of these strategies")


def _draw_inference(canvas: Canvas, stages: Stages, row: int, encoder: str, labeling: Round) -> None:
    sample = stages.predictions.iloc[row]
    middle_in = 2.66
    captions_in = 2.17
    canvas.text(0.1, 3.27, "Online inference", ha="left", va="top", fontweight="bold")
    seen = stages.seen(row)
    corners = np.concatenate([np.concatenate(pair) for pair in seen.values()])
    captions = {"init": "initial pose $T_0$:\n", "icp": r"aligned $\hat{T}\mathcal{P}$: "}
    for left_in, (which, pair) in zip((0.12, 1.56), seen.items(), strict=True):
        draw_clouds(canvas.panel(left_in, 2.2, 1.06, 0.94), *pair, 1.0, (corners.min(axis=0), corners.max(axis=0)))
        canvas.text(left_in + 0.53, captions_in, captions[which] + stages.words(row, which), va="top")
    canvas.arrow((1.2, middle_in), (1.54, middle_in), words="ICP")
    canvas.arrow((2.66, middle_in), (2.8, middle_in))
    corners_in = [(2.8, 3.02), (3.3, 2.86), (3.3, 2.46), (2.8, 2.3)]
    canvas.axes.fill(*zip(*corners_in, strict=True), facecolor=GRAY + "22", edgecolor=GRAY, linewidth=0.9)
    canvas.text(3.05, middle_in, f"{encoder}\n$f_\\theta$", va="center")
    canvas.text(3.05, captions_in, "frozen", va="top")
    canvas.arrow((3.3, middle_in), (3.46, middle_in))
    draw_embedding(canvas.panel(3.48, 2.3, 0.36, 0.72), stages.h_S_d[row])
    canvas.text(3.66, captions_in, rf"$\mathbf{{h}} \in \mathbb{{R}}^{{{stages.h_S_d.shape[1]}}}$", va="top")
    canvas.arrow((3.86, middle_in), (4.02, middle_in))
    canvas.box(4.02, 2.0, 1.2, 1.22, color=BLUE)
    canvas.text(4.62, 3.19, "multi-class GP classifier", va="top")
    _draw_labeled(canvas.panel(4.07, 2.17, 1.1, 0.88), stages, row, labeling)
    canvas.text(4.62, 2.03, "★ this sample", va="bottom")
    canvas.arrow((5.22, middle_in), (5.58, middle_in))
    draw_scores_with_numbers(canvas.panel(5.96, 2.42, 0.62, 0.62), sample)
    canvas.text(
        6.36, captions_in, rf"$\hat{{s}}_c \pm \sqrt{{v_c}}$;  $\hat{{c}}$ = {sample['concept_predicted']}", va="top"
    )


def _draw_labeled(axes, stages: Stages, row: int, labeling: Round) -> None:
    """Scatter the training samples by concept, and the sample that is shown."""
    of = stages.registrations
    for concept in CONCEPTS:
        rows = of.rows("train")[of.concept[of.rows("train")] == concept]
        look = {"marker": CONCEPT_MARKERS[concept], "color": CONCEPT_COLORS[concept], "alpha": 0.6, "linewidths": 0}
        axes.scatter(*labeling.map_S_2[rows].T, s=5, **look)
    axes.scatter(*labeling.map_S_2[row], s=45, marker="*", color=BLACK, zorder=5)
    axes.set_axis_off()


def _draw_active_learning(canvas: Canvas, stages: Stages, labeling: Round, new: str, curves: Mapping) -> None:
    """Draw pool, score, diversify, annotate, retrain from right to left: the way back of the loop."""
    heads_in = 1.58
    captions_in = 0.08
    middle_in = 0.86
    canvas.text(0.1, heads_in, "Active learning", ha="left", va="top", fontweight="bold")

    canvas.text(6.4, heads_in, r"Unlabeled pool $\mathcal{D}_U$", va="top")
    canvas.text(6.4, captions_in, f"{len(labeling.rows_N)} training samples", va="bottom")
    for place, of_pool in enumerate(thinned(labeling.rows_N, THUMBNAILS)):
        corner = (5.9 + 0.36 * (place % 3), 0.86 - 0.56 * (place // 3))
        _draw_thumbnail(canvas.panel(*corner, 0.34, 0.5), stages, of_pool)
    canvas.arrow((5.84, middle_in), (5.62, middle_in))

    canvas.text(5.04, heads_in, "Score: BALD", va="top")
    panel = canvas.panel(4.5, 0.36, 1.08, 1.02)
    bald_N = labeling.bald_N
    points_N_2 = labeling.map_S_2[labeling.rows_N]
    order = np.argsort(bald_N, kind="stable")
    panel.scatter(*labeling.map_S_2[labeling.labeled].T, s=5, marker="x", color=GRAY, linewidths=0.5)
    panel.scatter(*points_N_2[order].T, s=9, c=bald_N[order], cmap=blues(), edgecolors=GRAY, linewidths=0.3)
    panel.scatter(*points_N_2[labeling.candidates].T, s=26, facecolors="none", edgecolors=BLACK, linewidths=0.7)
    panel.set_axis_off()
    canvas.text(
        5.04,
        captions_in,
        f"{bald_N.min():.2f} to {bald_N.max():.2f} nats; $B K$ = {len(labeling.candidates)}\nringed; ×: labeled before",
        va="bottom",
    )
    canvas.arrow((4.46, middle_in), (4.24, middle_in))

    canvas.text(3.66, heads_in, "Diversify: $k$-means", va="top")
    panel = canvas.panel(3.12, 0.36, 1.08, 1.02)
    panel.scatter(*points_N_2[labeling.candidates].T, s=26, facecolors="white", edgecolors=BLACK, linewidths=0.7)
    panel.scatter(*points_N_2[labeling.chosen].T, s=26, facecolors=BLUE, edgecolors=BLACK, linewidths=0.7)
    panel.margins(0.12)
    panel.set_axis_off()
    canvas.text(3.66, captions_in, f"$B$ = {len(labeling.chosen)} kept,\none of each cluster", va="bottom")
    canvas.arrow((3.08, middle_in), (2.88, middle_in))

    canvas.text(2.4, heads_in, "Annotate", va="top")
    for place, i in enumerate(labeling.chosen[:4]):
        corner = (1.98 + 0.44 * (place % 2), 0.94 - 0.6 * (place // 2))
        _draw_thumbnail(canvas.panel(*corner, 0.4, 0.46), stages, labeling.rows_N[i])
        concept = stages.predictions["concept_true"][labeling.rows_N[i]]
        canvas.text(corner[0] + 0.2, corner[1] - 0.01, concept, va="top")
    canvas.arrow((1.92, middle_in), (1.72, middle_in))

    canvas.text(1.4, heads_in, f"Retrain: {new} is new", va="top")
    panel = canvas.panel(0.5, 0.38, 1.18, 1.0)
    for name in reversed(TITLES):
        if name in curves:
            color, line, width = STYLES[name]
            panel.plot(
                curves[name]["labels"], curves[name]["mean"], line, color=color, linewidth=width, label=TITLES[name]
            )
    low, high = panel.get_ylim()
    panel.set_ylim(bottom=low - 0.5 * (high - low))  # The legend needs room.
    panel.locator_params(axis="x", nbins=4, integer=True)
    panel.set_ylabel("accuracy (%)", fontsize=SMALL_PT, labelpad=1)
    panel.set_xlabel("labels", fontsize=SMALL_PT, labelpad=0)
    panel.tick_params(pad=1.5, length=2)
    panel.legend(loc="lower right", borderaxespad=0, handlelength=1.2, borderpad=0.1, labelspacing=0.2)


def _draw_thumbnail(axes, stages: Stages, row: int) -> None:
    target_Q_3, source_P_3 = stages.seen(row)["icp"]
    draw_clouds(axes, target_Q_3[::3], source_P_3[::3], size=0.4)
