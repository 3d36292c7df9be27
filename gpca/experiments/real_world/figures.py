"""Draws how GP-CA confuses concepts on depth frames, and whether its confidence can be believed, by backbone."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.diagnostics import BINS
from gpca.attribution.predictions import concepts_of, read_predictions
from gpca.errors import InputError
from gpca.evaluation.measures import source_method_seed
from gpca.experiments.confusions import counts_and_shares, pooled_confusions
from gpca.experiments.diagnosis.reliability import reliability_figure
from gpca.experiments.frames import encoder_title
from gpca.experiments.real_world.metrics import read_together
from gpca.reporting.figures.panels import draw_percentages, panels
from gpca.reporting.figures.style import TEXT_WIDTH_IN, write_title

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_real_world_confusions(metrics_csv: str | Path, title: str, methods: Sequence[str]) -> Figure:
    """Draw a matrix for each method ``{backbone}-{reduction}``: shares of each true concept in %, and counts."""
    pooled = {method: counts for (_, method), counts in pooled_confusions(read_together(metrics_csv)).items()}
    shown = {method: pooled[method] for method in methods if method in pooled}
    if not shown:
        raise InputError(metrics_csv, "has no confusion of these backbones", "regenerate it")
    width_in = min(TEXT_WIDTH_IN, max(3.2, 0.6 + 1.62 * len(shown)))
    figure, [axes] = panels(1, len(shown), (width_in - 0.6) / len(shown) + 0.6, width_in, sharey=True)
    for panel, (method, confusion) in zip(axes, shown.items(), strict=True):
        concepts = list(confusion.columns[:-1])
        counts_C_C, shares_C_C = counts_and_shares(confusion)
        draw_percentages(panel, 100 * shares_C_C, "{:.1f} %\nn = {:.0f}", counts_C_C, linespacing=1.2)
        panel.set_title(encoder_title(*method.split("-")), pad=3)
        panel.set_xticks(range(len(concepts)), concepts)
        panel.set_yticks(range(len(concepts)), concepts, rotation=90, va="center")
        panel.tick_params(length=0, pad=2)
        panel.spines[:].set(visible=True, linewidth=0.4)
    axes[0].set_ylabel("true", labelpad=1)
    figure.supxlabel("attributed to", fontsize=8)
    write_title(figure, title)
    return figure


def draw_frame_reliability(prediction_files: Iterable[str | Path], methods: Mapping[str, str], title: str) -> Figure:
    """Draw accuracy over confidence on the test samples of depth frames, all seeds together.

    Args:
        prediction_files: named ``…/{source}/{method}/seed{seed}.csv``, of one source.
    """
    parts: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}
    for path in prediction_files:
        rows = read_predictions(path)
        rows = rows[(rows["split"] == "test") & ~rows["abstained"]]
        scores_N_C = rows[[f"score_{concept}" for concept in concepts_of(rows)]].to_numpy(float)
        hit_N = (rows["concept_predicted"] == rows["concept_true"]).to_numpy()
        parts.setdefault(source_method_seed(path)[1], []).append((scores_N_C.max(axis=1), hit_N))
    shown = [method for method in methods if method in parts]
    if not shown:
        raise InputError("predictions on depth frames", "cover none of these methods", "run them first")
    samples = {}
    for method in shown:
        confidence_N, hit_N = (np.concatenate(columns) for columns in zip(*parts[method], strict=True))
        samples[methods[method]] = confidence_N, hit_N
    return reliability_figure(samples, title, BINS, least=1 / 3)
