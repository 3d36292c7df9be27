"""Draws how soon a new concept is learned in each embedding: accuracy over labels, sources as columns."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.experiments.active_learning.figure import draw_curves, mean_curves
from gpca.experiments.new_concepts.tables import SEEN
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures.style import BLUE, GRAY, GREEN, SKY_BLUE, VERMILION

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = "bald_kmeans"
ROWS = {"concepts": CONCEPTS, "nominal": ("nominal",), "geometry": ("geometry",)}
TITLES = {"concepts": "new: noise, pose\nor overlap", "nominal": "new: nominal", "geometry": "new: geometry"}
STYLES = {
    "pretrained": (GRAY, "-", 0.9),
    "other_samples": (BLUE, "-", 0.9),
    "other_source": (SKY_BLUE, "-", 0.9),
    "unseen": (VERMILION, "-", 1.8),
    "pair": (GREEN, "-", 1.8),
}


def draw_new_concepts(curve_files: Iterable[str | Path], sources: Mapping[str, str], target: float) -> Figure:
    """Draw the accuracy over labels by the paper's strategy, its mean over the new concepts, then over the seeds.

    Args:
        curve_files: Files named `…/{source}/{strategy}/seed{seed}.csv`, as :mod:`gpca.active_learning.curves` says.
        target: The accuracy that a dashed line marks.
    """
    curve_files = list(curve_files)
    curves = {
        (source, row, setting): curve
        for row, concepts in ROWS.items()
        for (source, strategy, setting), curve in mean_curves(curve_files, concepts).items()
        if strategy == SHOWN
    }
    return draw_curves(curves, sources, TITLES, SEEN, STYLES, target)
