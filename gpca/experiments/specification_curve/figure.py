"""Draws specification curves: the value that every reading gives in place of a printed number."""

from __future__ import annotations

from collections.abc import Mapping
from textwrap import shorten, wrap
from typing import TYPE_CHECKING

import numpy as np

from gpca.comparison.readings import asked_about
from gpca.errors import InputError
from gpca.objects.title import stand_in_clause
from gpca.reporting.figures.panels import panels
from gpca.reporting.figures.style import LIGHT_GRAY, PALETTE, SMALL_PT, YELLOW, write_title

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

COLUMNS = 3
PANEL_IN, LINE_IN = 1.9, 0.13  # the height of a row of panels, and what each line of the legends below it adds
FARTHEST = 30.0  # times the close tolerance
COLORS = tuple(color for color in PALETTE if color != YELLOW)  # Yellow lines are hard to see on white.
NUMBER = ["table", "row", "column"]  # what names a printed number
LETTERS = 48  # of a number's name, which a panel has room for
LINES = ("-", "--", ":")  # of the first numbers in a panel that have a color each, the next such, …


def draw_readings(judged: pd.DataFrame, groups: Mapping[str, str], sources: Mapping[str, Mapping]) -> Figure:
    """Draw a panel per group: a curve for each number that is not reproduced, its readings in order of their values.

    Args:
        judged: the rows that :func:`gpca.comparison.readings.read_judged` returned.
    """
    missed = asked_about(judged)
    shown = [name for name in groups if (missed["group"] == name).any()]
    if not shown:
        raise InputError("reading_verdicts.csv", "has no readings of these groups", "run the readings first")
    columns = min(COLUMNS, len(shown))
    of_groups = [dict(list(missed[missed["group"] == name].groupby(NUMBER, sort=False))) for name in shown]
    rows = [of_groups[i : i + columns] for i in range(0, len(shown), columns)]
    height_in = sum(PANEL_IN + LINE_IN * max(map(len, row)) for row in rows) + 0.5
    figure, axes = panels(len(rows), columns, height_in, sharey=True)
    for panel, group, of_group in zip(axes.flat, shown, of_groups, strict=False):
        _draw_group(panel, of_group)
        panel.set_title("\n".join(wrap(groups[group], 40)), fontsize=8)
    for panel in axes.flat[len(shown) :]:
        panel.set_visible(False)
    linear = "linear up to what is close, logarithmic beyond"
    figure.supylabel(f"distance from the printed number (times what is close; {linear})", fontsize=8)
    figure.supxlabel("share of the readings (%), from the lowest to the highest value", fontsize=8)
    write_title(figure, f"Every reading of the unstated{stand_in_clause(sources.values())}")
    return figure


def _draw_group(panel, of_numbers: Mapping[tuple[str, str, str], pd.DataFrame]) -> None:
    """Draw the curve of each number, and name them all below the panel, where no curve is."""
    panel.axhspan(-1, 1, color=LIGHT_GRAY, linewidth=0)
    for place, (key, of_number) in enumerate(of_numbers.items()):
        distance_R = np.sort(of_number["distance"].to_numpy().clip(-FARTHEST, FARTHEST))
        share_R = np.linspace(0, 100, len(distance_R)) if len(distance_R) > 1 else np.array([50.0])
        look = {
            "color": COLORS[place % len(COLORS)],
            "linestyle": LINES[place // len(COLORS) % len(LINES)],
            "label": _words(key),
        }
        panel.plot(share_R, distance_R, marker="o", markersize=1.6, linewidth=0.8, **look)
    panel.legend(
        fontsize=SMALL_PT,
        loc="upper left",
        bbox_to_anchor=(-0.1, -0.16),
        handlelength=1.6,
        borderaxespad=0,
        borderpad=0,
        labelspacing=0.2,
    )
    panel.set_yscale("symlog", linthresh=1)
    panel.set_ylim(-FARTHEST, FARTHEST)
    panel.set_yticks([-10, -1, 0, 1, 10], ["-10", "-1", "0", "1", "10"])


def _words(key: tuple[str, str, str]) -> str:
    """Return a number's place in one line: its table, row and column."""
    table, row, column = key
    return shorten(f"{table}: {row}, {column}", LETTERS, placeholder=" …")
