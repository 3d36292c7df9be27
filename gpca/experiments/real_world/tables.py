"""Makes Table VI of the paper: GP-CA on depth frames by backbone and reduction, and below it the classic features."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.metrics import ALL
from gpca.encoders.registry import make_encoder, parameter_count
from gpca.experiments.real_world.metrics import TOGETHER
from gpca.frames.source import ONE_ENCODER, REAL_WORLD
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.builder import TableBuilder, interval_over
from gpca.reporting.tables.cells import cell_of_repeats, plain_cell, rows_where
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

BACKBONES = {"dgcnn": "DGCNN", "pointnet": "PointNet", "pointnet2": "PointNet++", "pointnext": "PointNeXt-S"}
REDUCTIONS = {"none": "No reduction", "pca": "PCA", "umap": "UMAP", "autoencoder": "Autoencoder"}
CLASSIC = {
    "analytical_gpc": "Classic features",
    "analytical_gpc_no_counts": "Classic features without point counts",
}


def encoder_title(encoder: str, reduction: str) -> str:
    """Return the name of an encoder and the reduction after it in figures."""
    named = BACKBONES.get(encoder, encoder)
    return named if reduction == "none" else f"{named}, {REDUCTIONS.get(reduction, reduction)}"


def table6_of_encoders(
    metrics: pd.DataFrame,
    title: str,
    encoders: Mapping[str, Mapping],
    reductions: Sequence[str],
    pretrained_on: str = "",
) -> Table:
    """Return :func:`table6_backbones` with the parameters counted of encoders that are made from their settings."""
    backbones = {
        name: parameter_count(make_encoder(settings["backbone"], settings.get("options", {})))
        for name, settings in encoders.items()
    }
    return table6_backbones(metrics, title, backbones, reductions, pretrained_on)


def table6_backbones(
    metrics: pd.DataFrame,
    title: str,
    backbones: Mapping[str, int],
    reductions: Sequence[str],
    pretrained_on: str = "",
) -> Table:
    """Return the accuracy on depth frames by backbones × reductions, and of the classic features.

    Args:
        metrics: The tidy metrics of the methods ``{backbone}-{reduction}``, made by
            :func:`gpca.experiments.real_world.metrics.collect`.
        backbones: The number of parameters of each name, in order. The table shows differences to the first backbone
            with the first reduction.
        reductions: The names of the reductions, in order.
        pretrained_on: What the encoders learned from before the frames, if anything.
    """
    together = rows_where(metrics, table=TOGETHER)
    metrics, one_encoder = (rows_where(together, source=source) for source in (REAL_WORLD, ONE_ENCODER))
    first = next(iter(backbones))
    reference_R = _values(metrics, f"{first}-{reductions[0]}")
    table = TableBuilder("table6_backbones", {"backbone": "Backbone", "reduction": "Reduction"})
    for backbone, parameters in backbones.items():
        for reduction in reductions:
            labels = [(backbone, BACKBONES.get(backbone, backbone)), (reduction, REDUCTIONS[reduction])]
            method = f"{backbone}-{reduction}"
            cells = _cells(metrics, method, reference_R, not table.rows, parameters)
            table.add_row(labels, cells | {"classifiers": _deviation(one_encoder, method)} if cells else {})
    for method, name in CLASSIC.items():
        labels = [(method, name), ("none", REDUCTIONS["none"])]
        table.add_row(labels, _cells(metrics, method, reference_R, not table.rows))
    table.compare_down(["accuracy"])
    shown = table.first_cell("accuracy")
    rival = f"To {BACKBONES.get(first, first)}"
    encoder = f"encoder that goes on from one pretrained on {pretrained_on}" if pretrained_on else "encoder"
    other = " without reduction" if reductions[0] == "none" else f" with {REDUCTIONS[reductions[0]]}"
    return table.build(
        caption=f"GP-CA by backbone and dimensionality reduction, accuracy (%) on {title}",
        column_head="metric",
        columns={
            "accuracy": Column("Mean acc. (%)"),
            "classifiers": Column("Std. dev. (%)", decimals=2, interval=False, limits=(0, inf)),
            "deviation": Column("Of all (%)", decimals=2, interval=False, limits=(0, inf)),
            "difference": Column(f"{rival} (points)", limits=(-100, 100)),
            **{concept: Column(f"{concept.capitalize()} (%)", interval=False) for concept in CONCEPTS},
            "parameters": Column("Parameters (k)", decimals=0, interval=False, limits=(0, inf)),
        },
        footnotes=(
            f"Mean over {plural(shown.seeds, 'seed')}, {shown.test_samples // shown.seeds} test samples each, in "
            f"scenes that training does not see; {interval_over(shown.seeds)}. Each seed has its own split of the "
            f"scenes, perturbations, {encoder}, and GPC.",
            "Std. dev.: as the paper says, of classifiers on one encoder's embeddings, the first seed's. Of all: of "
            "the seeds of the mean.",
            f"{rival}: paired difference to it{other}. By concept: the share of its samples that is attributed to it. "
            "Parameters: of the encoder.",
        ),
    )


def _cells(
    metrics: pd.DataFrame, method: str, reference_R: np.ndarray, is_first: bool, parameters: int | None = None
) -> dict[str, Cell | None]:
    """Return the cells of a method; the first row of the table is not compared with itself."""
    accuracy_R = _values(metrics, method)
    seeds = len(accuracy_R)
    if not seeds:
        return {}
    samples = int(_values(metrics, method, "test_samples", scale=1).sum())
    cells: dict[str, Cell | None] = {"accuracy": cell_of_repeats(accuracy_R, samples)}
    if seeds > 1:
        cells["deviation"] = plain_cell(float(accuracy_R.std(ddof=1)), seeds, samples)
    if not is_first and seeds == len(reference_R):
        cells["difference"] = cell_of_repeats(accuracy_R - reference_R, samples)
    for concept in CONCEPTS:
        cells[concept] = cell_of_repeats(_values(metrics, method, concept=concept), samples)
    if parameters is not None:
        cells["parameters"] = plain_cell(parameters / 1000, seeds, samples)
    return cells


def _deviation(one_encoder: pd.DataFrame, method: str) -> Cell | None:
    accuracy_R = _values(one_encoder, method)
    return plain_cell(float(accuracy_R.std(ddof=1)), len(accuracy_R), 0) if len(accuracy_R) > 1 else None


def _values(
    metrics: pd.DataFrame, method: str, metric: str = "accuracy", concept: str = ALL, scale: float = 100
) -> np.ndarray:
    """Return the values over the seeds, in the order of the seeds."""
    chosen = rows_where(metrics, method=method, metric=metric, concept=concept)
    return chosen.sort_values("seed")["value"].to_numpy() * scale
