"""Draws what pictures of depth frames share: samples with their poses and scores, and clouds over models."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.io.container import require_same_samples
from gpca.io.csv_file import numbers, read_csv
from gpca.pairs.dataset import FRAME_COLUMNS
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures.cloud_views import draw_clouds
from gpca.reporting.figures.style import CONCEPT_COLORS, SMALL_PT

if TYPE_CHECKING:
    import pandas as pd

POSE_COLUMNS = ("sample", "split", "instance", "init_error", "icp_error", "lost_to")


def read_samples(poses_csv: str | Path, predictions_csv: str | Path) -> pd.DataFrame:
    """Return poses and predictions of all samples side by side, in the order of the registrations.

    Raises:
        InputError: an unusable file, or files of different samples.
    """
    poses = read_csv(poses_csv, POSE_COLUMNS, others=FRAME_COLUMNS)
    predictions = read_predictions(predictions_csv)
    require_same_samples(poses_csv, poses, predictions, "predictions")
    for name in ("instance", "init_error", "icp_error"):
        poses[name] = numbers(poses_csv, poses, name)
    added = [name for name in predictions.columns if name not in poses.columns]
    return poses.join(predictions[added])


def draw_over_model(axes, model: np.ndarray, source: np.ndarray, points: int = 1500) -> None:
    """Scatter a source over its model, both (P, 3) in the target's frame, seen from the camera's side.

    The view looks along the direction from which most of the source faces the viewer: its normal by least variance.
    """
    view = _view_of(source - model.mean(axis=0))
    model, source = (cloud[:: max(1, len(cloud) // points)] @ view.T for cloud in (model, source))
    draw_clouds(axes, model, source, size=1.2)


def _view_of(offset_P_3: np.ndarray) -> np.ndarray:
    """Return right, up and towards-the-viewer axes (3, 3): the measured side is nearer than the model's middle."""
    towards = offset_P_3.mean(axis=0) + np.array([1e-6, 0, 0])
    towards = towards / np.linalg.norm(towards)
    up = np.array([0.0, 0.0, 1.0]) if abs(towards[2]) < 0.95 else np.array([0.0, 1.0, 0.0])
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(towards, right), towards])


def draw_scores(axes, row: pd.Series) -> None:
    """Draw a sample's concept scores as bars with ± one standard deviation, the true concept's name in bold."""
    deviations = [np.sqrt(row[f"variance_{concept}"]) for concept in CONCEPTS]
    draw_score_bars(axes, [row[f"score_{concept}"] for concept in CONCEPTS], row["concept_true"], deviations)
    axes.set(xlim=(0, 1))
    axes.set_xticks([0, 0.5, 1], ["0", "0.5", "1"])


def draw_score_bars(
    axes, scores_C: Sequence[float], true_concept: str, deviations_C: Sequence[float] | None = None
) -> None:
    """Draw a bar for each concept from top to bottom, without axis at the left, the true concept's name in bold."""
    for place, concept in enumerate(CONCEPTS):
        deviation = None if deviations_C is None else deviations_C[place]
        look = {"color": CONCEPT_COLORS[concept], "height": 0.7, "error_kw": {"lw": 0.8}}
        axes.barh(place, scores_C[place], xerr=deviation, **look)
        weight = "bold" if concept == true_concept else "normal"
        axes.text(-0.03, place, concept, ha="right", va="center", fontsize=SMALL_PT, fontweight=weight)
    axes.set(ylim=(len(CONCEPTS) - 0.4, -0.6), yticks=[])
    axes.spines["left"].set_visible(False)
