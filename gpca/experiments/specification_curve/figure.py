"""Draws the value that every reading gives in place of a printed number: a line of dots for each number."""

from __future__ import annotations

from collections.abc import Mapping
from textwrap import shorten
from typing import TYPE_CHECKING

import numpy as np

from gpca.comparison.readings import unresolved
from gpca.errors import InputError
from gpca.objects.entry import stand_in_clause
from gpca.reporting.figures.panels import panels
from gpca.reporting.figures.style import BLUE, GRAY, LIGHT_GRAY, SMALL_PT, write_title

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

ROW_IN, HEAD_IN = 0.165, 0.85  # the height of a line, and what title and axis take
FARTHEST = 30.0  # times the close tolerance
NUMBER = ["table", "row", "column"]  # what names a printed number
LETTERS = 52  # of a number's name, which there is room for


def draw_readings(judged: pd.DataFrame, groups: Mapping[str, str], sources: Mapping[str, Mapping]) -> Figure:
    """Draw the readings of each number that is not reproduced as dots in a line, the lines of a group below its name.

    At the right stands how many of a number's readings are close.

    Args:
        judged: the rows that :func:`gpca.comparison.readings.read_judged` returned.
    """
    missed = unresolved(judged)
    of_groups = {
        name: dict(list(missed[missed["group"] == name].groupby(NUMBER, sort=False)))
        for name in groups
        if (missed["group"] == name).any()
    }
    if not of_groups:
        raise InputError("reading_verdicts.csv", "has no readings of these groups", "run the readings first")
    figure, [[panel]] = panels(1, 1, HEAD_IN + ROW_IN * sum(len(of_group) + 1 for of_group in of_groups.values()))
    panel.axvspan(-1, 1, color=LIGHT_GRAY, alpha=0.6, linewidth=0)
    panel.axvline(0, color=GRAY, linewidth=0.6)
    names: list[str] = []
    headings = []
    for group, of_group in of_groups.items():
        headings.append(len(names))
        names.append(groups[group])
        for key, rows in of_group.items():
            _draw_number(panel, len(names), rows)
            names.append(_words(key))
    panel.set_yticks(range(len(names)), names, fontsize=SMALL_PT)
    for place in headings:
        panel.get_yticklabels()[place].set_fontweight("bold")
    panel.tick_params(axis="y", length=0)
    panel.set_ylim(len(names) - 0.4, -0.6)
    panel.set_xscale("symlog", linthresh=1)
    panel.set_xlim(-1.1 * FARTHEST, 1.1 * FARTHEST)
    panel.set_xticks([-10, -1, 0, 1, 10], ["-10", "-1", "0", "1", "10"])
    panel.set_xlabel("distance from the printed number (times what is close; linear up to it, logarithmic beyond)")
    write_title(figure, f"Every reading of the unstated{stand_in_clause(sources.values())}; right: how many are close")
    return figure


def _draw_number(panel, place: int, rows: pd.DataFrame) -> None:
    """Draw the readings of one number as dots on the line that joins them, and count those that are close."""
    distance_R = np.sort(rows["distance"].to_numpy(float).clip(-FARTHEST, FARTHEST))
    panel.plot(distance_R[[0, -1]], [place, place], color=GRAY, linewidth=0.6)
    panel.scatter(distance_R, np.full(len(distance_R), place), s=9, color=BLUE, alpha=0.45, linewidths=0, zorder=3)
    words = f"{rows['close'].sum():.0f} of {len(rows)}"
    panel.text(1.01, place, words, transform=panel.get_yaxis_transform(), va="center", fontsize=SMALL_PT)


def _words(key: tuple[str, str, str]) -> str:
    """Return a number's place in one line: its table, row and column."""
    table, row, column = key
    return shorten(f"{table}: {row}, {column}", LETTERS, placeholder=" …")
