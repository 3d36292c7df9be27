"""Draws what GP-CA takes each concept for on depth frames, by backbone, with the numbers of samples."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.experiments.concept_attribution.confusions import counts_and_shares, pooled_confusions
from gpca.experiments.real_world.metrics import read_together
from gpca.experiments.real_world.tables import encoder_title
from gpca.reporting.figures.style import SMALL_PT, TEXT_WIDTH_IN, blues, save_figure, use_style, write_title


def draw_real_world_confusions(
    metrics_csv: str | Path, title: str, methods: Sequence[str], pdf_path: str | Path, png_path: str | Path
) -> None:
    """Draw a matrix for each method ``{backbone}-{reduction}``: shares of each true concept in %, and counts.

    Raises:
        InputError: an unusable file, or one without metrics of these methods.
    """
    pooled = {method: counts for (_, method), counts in pooled_confusions(read_together(metrics_csv)).items()}
    shown = {method: pooled[method] for method in methods if method in pooled}
    if not shown:
        raise InputError(metrics_csv, "has no confusion of these backbones", "regenerate it")
    plt = use_style()
    panel_in = min(1.5, (TEXT_WIDTH_IN - 0.6) / len(shown) - 0.12)
    width_in = max(3.2, 0.6 + len(shown) * (panel_in + 0.12))
    height_in = panel_in + 0.72
    figure = plt.figure(figsize=(width_in, height_in))
    for number, (method, counts) in enumerate(shown.items()):
        left_in = 0.6 + number * (panel_in + 0.12)
        axes = figure.add_axes((left_in / width_in, 0.32 / height_in, panel_in / width_in, panel_in / height_in))
        concepts = list(counts.columns[:-1])
        counts_C_C, shares_C_C = counts_and_shares(counts)
        axes.imshow(np.ma.masked_invalid(shares_C_C), cmap=blues(), vmin=0, vmax=1)
        for (row, column), share in np.ndenumerate(shares_C_C):
            if np.isfinite(share):
                words = f"{100 * share:.1f} %\nn = {counts_C_C[row, column]:.0f}"
                colour = "white" if share > 0.65 else "black"
                axes.text(
                    column, row, words, ha="center", va="center", linespacing=1.2, fontsize=SMALL_PT, color=colour
                )
        backbone, _, reduction = method.partition("-")
        axes.set_title(encoder_title(backbone, reduction), pad=3)
        axes.set_xticks(range(len(concepts)), concepts)
        axes.set_yticks(range(len(concepts)), concepts if number == 0 else [], rotation=90, va="center")
        axes.tick_params(length=0, pad=2)
        axes.spines[:].set(visible=True, linewidth=0.4)
        if number == 0:
            axes.set_ylabel("true", labelpad=1)
    figure.text(0.5, 0.02, "attributed to", ha="center", va="bottom")
    write_title(figure, title)
    save_figure(figure, pdf_path, png_path)
