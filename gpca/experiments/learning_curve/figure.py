"""Draws balanced accuracy and regret over the number of training samples, beside the truth from other starts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from gpca.causes.judged import CEILING
from gpca.errors import InputError
from gpca.experiments.learning_curve.learners import TITLES
from gpca.reporting.figures.panels import in_lines, legend_below, panels
from gpca.reporting.figures.style import BLUE, COLUMN_WIDTH_IN, GRAY, ORANGE

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

COLORS = {"trees": BLUE, "gpca": ORANGE}
MEASURES = {"balanced_accuracy": "balanced accuracy (%)", "regret": "regret (%)"}
PANEL_IN = 1.5


def draw_learning_curve(curves: pd.DataFrame, sources: Mapping[str, str]) -> Figure:
    """Draw the mean over orders and seeds, and as a band the range of the orders and seeds.

    Args:
        curves: What :func:`gpca.experiments.learning_curve.curve.read_curves` returned.
    """
    from matplotlib.ticker import NullLocator

    shown = [name for name in sources if (curves["source"] == name).any()]
    if not shown:
        raise InputError("learning curves", "have no results for these sources", "run them first")
    height = 0.6 + PANEL_IN * len(MEASURES)
    figure, axes = panels(len(MEASURES), len(shown), height, COLUMN_WIDTH_IN, sharex=True, sharey="row")
    learned = curves[curves["learner"] != CEILING]
    ticks = sorted(learned["samples"].unique())
    for column, source in enumerate(shown):
        of_source = curves[curves["source"] == source]
        for row, (measure, label) in enumerate(MEASURES.items()):
            panel = axes[row, column]
            for name, color in COLORS.items():
                by_size = of_source[of_source["learner"] == name].groupby("samples")[measure]
                panel.plot(by_size.mean().index, 100 * by_size.mean(), "o-", color=color, markersize=3)
                panel.fill_between(
                    by_size.min().index, 100 * by_size.min(), 100 * by_size.max(), color=color, alpha=0.2, linewidth=0
                )
            reached = 100 * of_source.loc[of_source["learner"] == CEILING, measure].mean()
            panel.axhline(reached, color=GRAY, linestyle="--")
            panel.set_xscale("log")
            panel.set_xticks(ticks, [f"{tick:g}" for tick in ticks], rotation=45)
            panel.xaxis.set_minor_locator(NullLocator())
            if column == 0:
                panel.set_ylabel(label)
        axes[0, column].set_title(in_lines(sources[source]))
        axes[-1, column].set_xlabel("training samples")
    legend_below(figure, _handles(), columns=1)
    return figure


def _handles() -> list:
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=COLORS[name], marker="o", markersize=3, label=TITLES[name]) for name in COLORS]
    return [
        *handles,
        Line2D([], [], color=GRAY, linestyle="--", label="truth from other starts (counterfactual access)"),
    ]
