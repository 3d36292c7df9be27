"""What pictures of depth frames share: samples with their poses and scores, and clouds drawn over models."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.errors import InputError
from gpca.perturbation import CONCEPTS
from gpca.predictions import numbers, read_csv, read_predictions
from gpca.reporting.concepts_figure import RED
from gpca.reporting.style import BLUE, GREEN, ORANGE, PURPLE

if TYPE_CHECKING:
    import pandas as pd

COLOURS = dict(zip(CONCEPTS, (ORANGE, PURPLE, GREEN), strict=True))
POSE_COLUMNS = ("sample", "split", "instance", "init_error", "icp_error", "lost_to")


def read_samples(poses_csv: str | Path, predictions_csv: str | Path) -> pd.DataFrame:
    """Return poses and predictions of all samples side by side, in the order of the registrations.

    Raises:
        InputError: an unusable file, or files of different samples.
    """
    poses, predictions = read_csv(poses_csv, POSE_COLUMNS), read_predictions(predictions_csv)
    if not (poses[["split", "sample"]].to_numpy() == predictions[["split", "sample"]].to_numpy()).all():
        raise InputError(poses_csv, f"holds other samples than {predictions_csv}", "make both anew from one config")
    for name in ("instance", "init_error", "icp_error"):
        poses[name] = numbers(poses_csv, poses, name)
    added = [name for name in predictions.columns if name not in poses.columns]
    return poses.join(predictions[added])


def draw_over_model(axes, model: np.ndarray, source: np.ndarray, points: int = 1500) -> None:
    """Scatter a source (blue) over its model (red), both (P, 3) in the target's frame, seen from the camera's side.

    The view looks along the direction from which most of the source faces the viewer: its normal by least variance.
    """
    from matplotlib.colors import to_rgb

    view = _view_of(source - model.mean(axis=0))
    clouds = [cloud[:: max(1, len(cloud) // points)] @ view.T for cloud in (model, source)]
    drawn = np.concatenate(clouds)
    colours = np.repeat([to_rgb(RED), to_rgb(BLUE)], [len(cloud) for cloud in clouds], axis=0)
    depth = drawn[:, 2]
    colours = colours + (1 - colours) * 0.75 * ((depth.max() - depth) / max(np.ptp(depth), 1e-9))[:, None]
    order = np.argsort(depth, kind="stable")
    axes.scatter(drawn[order, 0], drawn[order, 1], s=1.2, c=colours[order], linewidths=0)
    axes.set_aspect("equal")
    axes.set_axis_off()


def _view_of(offset_P_3: np.ndarray) -> np.ndarray:
    """Return right, up and towards-the-viewer axes (3, 3): the measured side is nearer than the model's middle."""
    towards = offset_P_3.mean(axis=0) + np.array([1e-6, 0, 0])
    towards = towards / np.linalg.norm(towards)
    up = np.array([0.0, 0.0, 1.0]) if abs(towards[2]) < 0.95 else np.array([0.0, 1.0, 0.0])
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(towards, right), towards])


def draw_scores(axes, row: pd.Series, label_pt: float = 7) -> None:
    """Draw a sample's concept scores as bars with ± one standard deviation, the true concept's name in bold."""
    for place, concept in enumerate(CONCEPTS):
        deviation = np.sqrt(row[f"variance_{concept}"])
        axes.barh(
            place, row[f"score_{concept}"], xerr=deviation, color=COLOURS[concept], height=0.7, error_kw={"lw": 0.8}
        )
        weight = "bold" if concept == row["concept_true"] else "normal"
        axes.text(-0.03, place, concept, ha="right", va="center", fontsize=label_pt, fontweight=weight)
    axes.set(xlim=(0, 1), ylim=(len(CONCEPTS) - 0.4, -0.6), yticks=[])
    axes.set_xticks([0, 0.5, 1], ["0", "0.5", "1"])
    axes.spines["left"].set_visible(False)
