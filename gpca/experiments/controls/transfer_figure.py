"""Draws how much of its accuracy every explainer keeps on sources that it did not learn from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from gpca.errors import InputError
from gpca.experiments.controls.settings import PAPER, TRANSFER
from gpca.reporting.figures.panels import draw_percentages, in_lines, label_outer, panels_in_lines
from gpca.reporting.figures.style import SMALL_PT, write_title
from gpca.reporting.tables.cells import rows_where

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


def draw_transfer(intervals: pd.DataFrame, sources: Mapping[str, str], explainers: Mapping[str, str]) -> Figure:
    """Draw a matrix for each explainer: rows are the sources that it learned from, columns those that it explains.

    Args:
        intervals: What :func:`gpca.experiments.controls.intervals.collect` returned.
    """
    accuracy = rows_where(intervals, metric="accuracy")
    moved = rows_where(accuracy, control=TRANSFER)
    shown = [name for name in explainers if (moved["method"] == name).any()]
    if not shown:
        raise InputError("intervals", "have no transfer", "run the controls of two sources first")
    figure, drawn = panels_in_lines(len(shown), 1.55)
    letters = [chr(ord("A") + i) for i in range(len(sources))]
    for panel, name in zip(drawn, shown, strict=True):
        shares = _matrix(rows_where(accuracy, method=name), list(sources))
        draw_percentages(panel, shares, "{:.1f}")
        panel.set_title(in_lines(explainers[name]), fontsize=SMALL_PT)
        panel.set_xticks(range(len(letters)), letters)
        panel.set_yticks(range(len(letters)), letters)
        panel.tick_params(length=0, labelsize=SMALL_PT)
        panel.set_box_aspect(1)
    label_outer(drawn, "", "learned from")
    key = ", ".join(f"{letter} {title}" for letter, title in zip(letters, sources.values(), strict=True))
    write_title(figure, f"Accuracy (%) on the test samples of the column. {key}")
    return figure


def _matrix(accuracy: pd.DataFrame, sources: list[str]) -> np.ndarray:
    shares = np.full((len(sources), len(sources)), np.nan)
    for row, trained_on in enumerate(sources):
        for column, tested in enumerate(sources):
            control = PAPER if row == column else TRANSFER
            found = rows_where(accuracy, control=control, source=tested, trained_on=trained_on)
            if len(found):
                shares[row, column] = 100 * found["value"].iloc[0]
    return shares
