"""Draws what was measured beside what was promised: coverage and size of sets, and the two risks of the alarm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.errors import InputError
from gpca.evaluation.measures import ALL, POOLED
from gpca.experiments.guarantee.answers import BY_FAMILY, BY_SAMPLE, BY_STATE, CONFIDENT, FAMILIES, PLAIN
from gpca.experiments.guarantee.metrics import COVERAGE, FALSE_ALARMS, MISSED, SHARES, SIZE
from gpca.guarantee.guarantee import STATES
from gpca.reporting.figures.panels import in_lines, legend_below, panels
from gpca.reporting.figures.style import (
    BLUE,
    COLUMN_WIDTH_IN,
    GRAY,
    GREEN,
    ORANGE,
    PURPLE,
    SMALL_PT,
    VERMILION,
)
from gpca.reporting.tables.cells import rows_where

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

LOOKS = {  # variant -> label, color, marker
    PLAIN: ("not calibrated", VERMILION, "x"),
    BY_SAMPLE: ("by sample", BLUE, "o"),
    BY_STATE: ("by sample, each state", PURPLE, "s"),
    CONFIDENT: ("by sample, with confidence", ORANGE, "D"),
    BY_FAMILY: ("by family", GREEN, "^"),
}
PANELS = {
    COVERAGE: "sets that hold\nthe state (%)",
    SIZE: "states in a set",
    MISSED: "failed called\ngood (%)",
    FALSE_ALARMS: "good called\nfailed (%)",
}
ROW_IN = 0.34
SPREAD = 0.7  # of a row, over which the variants of an explainer are spread


def draw_guarantee(measured: pd.DataFrame, explainers: Mapping[str, str], promised: Mapping[str, Any]) -> Figure:
    """Draw a row for each explainer and a panel for each of coverage, set size and the two risks.

    Lines mark what is promised, dashed where it is promised for new families. Bars are 95 % intervals.

    Args:
        measured: What :func:`gpca.experiments.guarantee.metrics.read_guarantee` returned.
        promised: The settings of :class:`gpca.experiments.guarantee.settings.GuaranteeSettings`.
    """
    rows = rows_where(measured, condition=FAMILIES, concept=ALL)
    rows = rows[rows["source"] == (POOLED if (rows["source"] == POOLED).any() else rows["source"].iloc[:1].sum())]
    shown = [name for name in explainers if (rows["method"] == name).any()]
    if not shown:
        raise InputError("guarantee", "has no results for these explainers", "run them first")
    figure, grid = panels(2, 2, 2.1 + 2 * ROW_IN * len(shown), COLUMN_WIDTH_IN, sharey=True)
    offsets = dict(zip(LOOKS, np.linspace(-SPREAD / 2, SPREAD / 2, len(LOOKS)), strict=True))
    for panel, (metric, label) in zip(grid.flat, PANELS.items(), strict=True):
        scale = 100 if metric in SHARES else 1
        for variant, (_, color, marker) in LOOKS.items():
            of_variant = rows_where(rows, metric=metric, variant=variant).set_index("method")
            for place, name in enumerate(shown):
                if name in of_variant.index:
                    low, value, high = (scale * of_variant.loc[name, column] for column in ("low", "value", "high"))
                    y = place + offsets[variant]
                    panel.plot([low, high], [y, y], color=color, linewidth=0.8)
                    panel.plot(value, y, marker, color=color, markersize=3)
        for line, style in _promises(metric, promised):
            panel.axvline(line, color=GRAY, linewidth=0.8, linestyle=style, zorder=0)
        panel.set_xlabel(label, fontsize=SMALL_PT)
        panel.tick_params(labelsize=SMALL_PT)
        if metric == SIZE:
            panel.set_xlim(0.8, len(STATES) + 0.2)
            panel.set_xticks(range(1, len(STATES) + 1))
        else:
            panel.set_xlim((None, 101) if metric == COVERAGE else (-1, None))
    grid[0, 0].set_yticks(range(len(shown)), [in_lines(explainers[name], 18) for name in shown])
    grid[0, 0].set_ylim(len(shown) - 0.45, -0.55)
    legend_below(figure, _handles(), columns=2, fontsize=SMALL_PT)
    return figure


def _promises(metric: str, promised: Mapping[str, Any]) -> list[tuple[float, str]]:
    if metric == COVERAGE:
        return [(100 * promised["level"], "-")]
    if metric == SIZE:
        return []
    own = promised["missed" if metric == MISSED else "false_alarms"]
    return [(100 * own, "-"), (100 * promised["family_risk"], "--")]


def _handles() -> list:
    from matplotlib.lines import Line2D

    return [
        *(
            Line2D([], [], color=color, marker=marker, markersize=3, linewidth=0.8, label=label)
            for label, color, marker in LOOKS.values()
        ),
        Line2D([], [], color=GRAY, linewidth=0.8, label="promised (dashed: by family)"),
    ]
