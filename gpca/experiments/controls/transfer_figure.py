"""Draws what every explainer keeps of its accuracy on sources that it did not learn from."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.errors import InputError
from gpca.experiments.controls.settings import PAPER, TRANSFER
from gpca.reporting.figures.panels import in_lines
from gpca.reporting.figures.style import SMALL_PT, TEXT_WIDTH_IN, blues, save_figure, use_style, write_title
from gpca.reporting.tables.builder import rows_where

if TYPE_CHECKING:
    import pandas as pd

WIDEST = 5  # panels in a row


def draw_transfer(
    intervals: pd.DataFrame,
    sources: Mapping[str, str],
    explainers: Mapping[str, str],
    pdf_path: str | Path,
    png_path: str | Path,
) -> None:
    """Draw a matrix for each explainer: rows the source that it learned from, columns the one that it is asked about.

    Args:
        intervals: What :func:`gpca.experiments.controls.intervals.collect` returned.
        sources, explainers: The title of each name, in order; explainers without numbers are left out.
        pdf_path, png_path: The two files to write.

    Raises:
        InputError: the intervals hold no transfer of these.
    """
    accuracy = rows_where(intervals, metric="accuracy")
    moved = rows_where(accuracy, control=TRANSFER)
    shown = [name for name in explainers if (moved["method"] == name).any()]
    if not shown:
        raise InputError("intervals", "have no transfer", "run the controls of two sources first")
    plt = use_style()
    lines = -(-len(shown) // WIDEST)
    height_in = 0.75 + 1.55 * lines
    figure, axes = plt.subplots(
        lines, WIDEST, figsize=(TEXT_WIDTH_IN, height_in), sharex=True, sharey=True, squeeze=False
    )
    letters = [chr(ord("A") + i) for i in range(len(sources))]
    for panel, name in zip(axes.flat, shown, strict=False):
        shares = _matrix(rows_where(accuracy, method=name), list(sources))
        panel.imshow(np.ma.masked_invalid(shares), cmap=blues(), vmin=0, vmax=100, aspect="auto")
        for (row, column), share in np.ndenumerate(shares):
            if np.isfinite(share):
                colour = "white" if share > 65 else "black"
                panel.text(column, row, f"{share:.1f}", ha="center", va="center", fontsize=SMALL_PT, color=colour)
        panel.set_title(in_lines(explainers[name]), fontsize=SMALL_PT)
        panel.set_xticks(range(len(letters)), letters)
        panel.set_yticks(range(len(letters)), letters)
        panel.tick_params(length=0, labelsize=SMALL_PT, labelbottom=True)
    for panel in axes.flat[len(shown) :]:
        panel.set_visible(False)
    for line in axes:
        line[0].set_ylabel("learned from")
    key = ", ".join(f"{letter} {title}" for letter, title in zip(letters, sources.values(), strict=True))
    write_title(figure, f"Accuracy (%) on the test samples of the column. {key}")
    figure.tight_layout(rect=(0, 0, 1, 1 - 0.22 / height_in), pad=0.4, h_pad=0.8, w_pad=0.6)
    save_figure(figure, pdf_path, png_path)


def _matrix(accuracy: pd.DataFrame, sources: list[str]) -> np.ndarray:
    shares = np.full((len(sources), len(sources)), np.nan)
    for row, trained_on in enumerate(sources):
        for column, tested in enumerate(sources):
            control = PAPER if row == column else TRANSFER
            found = rows_where(accuracy, control=control, source=tested, trained_on=trained_on)
            if len(found):
                shares[row, column] = 100 * found["value"].iloc[0]
    return shares
