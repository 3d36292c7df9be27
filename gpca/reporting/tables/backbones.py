"""Table VI of the paper: GP-CA on depth frames by backbone and reduction, with the paper's classic features below."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf, nan
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.metrics import ALL, mean_interval
from gpca.errors import InputError
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.table import Cell, Cells, Column, Rows, Table

if TYPE_CHECKING:
    import pandas as pd

BACKBONES = {"dgcnn": "DGCNN", "pointnet": "PointNet", "pointnet2": "PointNet++", "pointnext": "PointNeXt-S"}
REDUCTIONS = {"none": "No reduction", "pca": "PCA", "umap": "UMAP", "autoencoder": "Autoencoder"}
CLASSIC = {
    "analytical_gpc": "Classic features",
    "analytical_gpc_no_counts": "Classic features without point counts",
}


def encoder_title(encoder: str, reduction: str) -> str:
    """Return what figures call an encoder and the reduction after it."""
    named = BACKBONES.get(encoder, encoder)
    return named if reduction == "none" else f"{named}, {REDUCTIONS.get(reduction, reduction)}"


def table6_backbones(
    metrics: pd.DataFrame,
    title: str,
    backbones: Mapping[str, int],
    reductions: Sequence[str],
) -> Table:
    """Accuracy on depth frames: backbones × reductions, and the classic features.

    Args:
        metrics: tidy (:func:`gpca.attribution.metrics.collect`); methods are named ``{backbone}-{reduction}``.
        title: of the frames.
        backbones: name -> number of parameters, in order; differences are to the first, with the first reduction.
        reductions: in order.

    Raises:
        InputError: the metrics hold none of these.
    """
    rows: Rows = []
    cells: Cells = {}
    methods: list[tuple[str, tuple[str, str], tuple[str, str], int | None]] = [
        (f"{b}-{r}", (b, BACKBONES.get(b, b)), (r, REDUCTIONS[r]), n) for b, n in backbones.items() for r in reductions
    ]
    methods += [(name, (name, title), ("none", REDUCTIONS["none"]), None) for name, title in CLASSIC.items()]
    reference_R = _values(metrics, methods[0][0])
    for method, *labels, parameters in methods:
        accuracy_R = _values(metrics, method)
        if not len(accuracy_R):
            continue
        row = len(rows)
        samples = int(_values(metrics, method, "test_samples", scale=1).sum())
        cells[row, "accuracy"] = _cell(accuracy_R, samples)
        if len(accuracy_R) > 1:
            cells[row, "deviation"] = Cell(float(accuracy_R.std(ddof=1)), nan, len(accuracy_R), samples)
        if row and len(accuracy_R) == len(reference_R):
            cells[row, "difference"] = _cell(accuracy_R - reference_R, samples)
        for concept in CONCEPTS:
            if len(of_concept_R := _values(metrics, method, concept=concept)):
                cells[row, concept] = _cell(of_concept_R, samples)
        if parameters is not None:
            cells[row, "parameters"] = Cell(parameters / 1000, nan, len(accuracy_R), samples)
        rows.append(tuple(labels))
    if not rows:
        raise InputError("metrics", "hold no accuracy for table6_backbones", "run its explainers first")
    first = " without reduction" if reductions[0] == "none" else f" with {REDUCTIONS[reductions[0]]}"
    seeds, samples = cells[0, "accuracy"].seeds, cells[0, "accuracy"].test_samples
    return Table(
        name="table6_backbones",
        caption=f"GP-CA by backbone and dimensionality reduction, accuracy (%) on {title}",
        row_heads={"backbone": "Backbone", "reduction": "Reduction"},
        rows=tuple(rows),
        column_head="metric",
        columns={
            "accuracy": Column("Mean acc. (%)"),
            "deviation": Column("Std. dev. (%)", decimals=2, interval=False, limits=(0, inf)),
            "difference": Column(f"To {BACKBONES.get(next(iter(backbones)), '')} (points)", limits=(-100, 100)),
            **{concept: Column(f"{concept.capitalize()} (%)", interval=False) for concept in CONCEPTS},
            "parameters": Column("Parameters (k)", decimals=0, interval=False, limits=(0, inf)),
        },
        cells=cells,
        compared=([(row, "accuracy") for row in range(len(rows))],),
        footnotes=(
            f"Mean over {seeds} seed{'s' * (seeds != 1)}, {samples // seeds} test samples each, in frames that "
            "training does not see; ± is the half-width of the 95 % t-interval over the seeds. Each seed has its own "
            "split of the frames, perturbations, encoders and GPCs.",
            f"To {BACKBONES.get(next(iter(backbones)), '')}: paired difference to it{first}. By concept: the share of "
            "its samples that is attributed to it. Parameters: of the encoder.",
        ),
    )


def _values(metrics, method: str, metric: str = "accuracy", concept: str = ALL, scale: float = 100) -> np.ndarray:
    of_cell = metrics[(metrics["method"] == method) & (metrics["metric"] == metric) & (metrics["concept"] == concept)]
    return of_cell.sort_values("seed")["value"].to_numpy() * scale


def _cell(values_R: np.ndarray, samples: int) -> Cell:
    mean, low, _ = mean_interval(values_R)
    return Cell(mean, mean - low, len(values_R), samples)
