"""Draws what every reading of the unstated gives in place of the printed numbers: specification curves."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.comparison.readings import asked_about
from gpca.errors import InputError
from gpca.objects.title import stand_in_clause
from gpca.reporting.figures.style import (
    GREY,
    LIGHT_GREY,
    PALETTE,
    SMALL_PT,
    TEXT_WIDTH_IN,
    save_figure,
    use_style,
    write_title,
)

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = 3
ROW_IN = 2.1
FARTHEST = 30.0  # times what is close
MOST_NAMED = 6  # numbers with a colour of their own; a panel with more has one colour for all


def draw_readings(
    judged: pd.DataFrame,
    groups: Mapping[str, str],
    sources: Mapping[str, Mapping],
    pdf_path: str | Path,
    png_path: str | Path,
) -> None:
    """Draw a panel per group: a curve for each number that is not reproduced, its readings in order of their values.

    Args:
        judged: what :func:`gpca.comparison.readings.read_judged` returned.
        groups: The title of each group, in order; those without such a number are left out.
        sources: source -> title and whether it is a stand-in.
        pdf_path, png_path: The two files to write.

    Raises:
        InputError: there is no number to draw.
    """
    missed = asked_about(judged)
    shown = [name for name in groups if (missed["group"] == name).any()]
    if not shown:
        raise InputError("reading_verdicts.csv", "has no readings of these groups", "run the readings first")
    use_style()
    import matplotlib.pyplot as plt
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    columns = min(COLUMNS, len(shown))
    lines = -(-len(shown) // columns)
    height_in = ROW_IN * lines + 0.3
    figure, axes = plt.subplots(
        lines,
        columns,
        figsize=(TEXT_WIDTH_IN, height_in),
        sharey=True,
        squeeze=False,
        layout=ConstrainedLayoutEngine(rect=(0, 0, 1, 1 - 0.25 / height_in)),
    )
    for panel, group in zip(axes.flat, shown, strict=False):
        _draw_group(panel, missed[missed["group"] == group])
        panel.set_title(groups[group], fontsize=8)
    for panel in axes.flat[len(shown) :]:
        panel.set_visible(False)
    figure.supylabel("distance from the printed number\n(times what is close)", fontsize=8)
    figure.supxlabel("share of the readings, from the lowest to the highest value", fontsize=8)
    write_title(figure, f"Every reading of the unstated{stand_in_clause(sources.values())}")
    save_figure(figure, pdf_path, png_path)


def _draw_group(panel, rows: pd.DataFrame) -> None:
    panel.axhspan(-1, 1, color=LIGHT_GREY, linewidth=0)
    curves = list(rows.groupby(["table", "row", "column"], sort=False))
    for number, (key, of_number) in enumerate(curves):
        distance_R = np.sort(of_number["distance"].to_numpy().clip(-FARTHEST, FARTHEST))
        share_R = np.linspace(0, 100, len(distance_R)) if len(distance_R) > 1 else np.array([50.0])
        named = len(curves) <= MOST_NAMED
        style = {"color": PALETTE[number], "label": _short(key)} if named else {"color": GREY, "alpha": 0.5}
        panel.plot(share_R, distance_R, marker="o", markersize=1.6, linewidth=0.8, **style)
    if len(curves) <= MOST_NAMED:
        panel.legend(fontsize=SMALL_PT, loc="best", handlelength=1.2, borderpad=0.2, labelspacing=0.2)
    panel.set_yscale("symlog", linthresh=1)
    panel.set_ylim(-FARTHEST, FARTHEST)
    panel.set_yticks([-10, -1, 0, 1, 10], ["-10", "-1", "0", "1", "10"])


def _short(key: tuple[str, str, str]) -> str:
    """Return a number's place in one line: its table, and the start of its row and column."""
    table, row, column = key
    return f"{table}: {row.split(',')[0][:12]}, {column[:10]}"
