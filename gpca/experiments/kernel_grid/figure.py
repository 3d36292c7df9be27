"""Draws accuracy and confidence over iterations by kernel and learning rate, beside the paper's numbers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from gpca.comparison.published import Number
from gpca.errors import InputError
from gpca.experiments.kernel_grid.grid import PRINTED
from gpca.experiments.kernel_grid.tables import TITLES
from gpca.reporting.figures.panels import in_lines, legend_below, panels
from gpca.reporting.figures.style import BLACK, BLUE, COLUMN_WIDTH_IN, GRAY, ORANGE

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

COLORS = {"rbf": BLUE, "matern32": ORANGE, "polynomial": BLACK}
LINES: tuple[Any, ...] = ("-", (0, (4, 2)), ":", "-.")  # The largest learning rate has the first.
# Kernels whose curves coincide show beneath each other: the first drawn is the widest.
WIDTHS = {"matern32": 2.2, "polynomial": 1.0, "rbf": 1.0}
PRINTED_MARKERS = ("D", "v")  # of what the paper prints for the largest learning rate, and for a smaller one
BESIDE = dict(zip(COLORS, (1.15, 1.32, 1.52), strict=True))  # Equal printed numbers would hide one another.
MEASURES = {"accuracy": "accuracy (%)", "confidence": "mean confidence (%)"}


def draw_kernel_curves(grid: pd.DataFrame, sources: Mapping[str, str], numbers: Iterable[Number]) -> Figure:
    """Draw means over the seeds; circles are the settings of Table IV, and filled symbols beside them what it prints.

    Args:
        grid: The frame that :func:`gpca.experiments.kernel_grid.grid.read_grids` returns.
    """
    grid = grid[grid["kernel"].isin(COLORS)]  # gpytorch's own classes would draw the same curves
    shown = [name for name in sources if (grid["source"] == name).any()]
    if not shown:
        raise InputError("kernels", "have no results for these sources", "run them first")
    from matplotlib.lines import Line2D
    from matplotlib.ticker import NullLocator

    numbers = list(numbers)
    figure, axes = panels(len(MEASURES), len(shown), 4.05, COLUMN_WIDTH_IN, sharex=True, sharey=True)
    rates = sorted(grid["learning_rate"].unique(), reverse=True)
    ticks = sorted(grid["iterations"].unique())
    for column, source in enumerate(shown):
        of_source = grid[grid["source"] == source]
        means = of_source.groupby(["kernel", "learning_rate", "iterations"])[list(MEASURES)].mean()
        for row, measure in enumerate(MEASURES):
            panel = axes[row, column]
            by_kernel = means[measure].groupby(level=["kernel", "learning_rate"])
            for (kernel, rate), curve in sorted(by_kernel, key=lambda item: list(WIDTHS).index(item[0][0])):
                iterations = curve.index.get_level_values("iterations")
                line = LINES[rates.index(rate) % len(LINES)]
                panel.plot(iterations, 100 * curve, color=COLORS[kernel], linestyle=line, linewidth=WIDTHS[kernel])
            for setting in PRINTED:
                if setting in means.index:
                    marker = {"color": COLORS[setting[0]], "markerfacecolor": "white", "markersize": 5}
                    panel.plot(setting[2], 100 * means.loc[setting, measure], "o", clip_on=False, zorder=5, **marker)
            for (kernel, rate, iterations), value in printed_accuracies(numbers, source).items():
                if measure == "accuracy" and (kernel, rate, iterations) in means.index:
                    symbol = PRINTED_MARKERS[int(rate < rates[0])]
                    filled = {"color": COLORS[kernel], "markersize": 3.5, "clip_on": False}
                    panel.plot(BESIDE[kernel] * iterations, value, symbol, **filled)
            panel.set_xscale("log")
            panel.set_xticks(ticks, [f"{tick}" for tick in ticks])
            panel.xaxis.set_minor_locator(NullLocator())
            panel.set(xlim=(0.9 * ticks[0], 1.65 * ticks[-1]), ylim=(30, 100))
        axes[0, column].set_title(in_lines(sources[source]))
        axes[-1, column].set_xlabel("iterations")
    for row, label in enumerate(MEASURES.values()):
        axes[row, 0].set_ylabel(label)
    handles = [
        Line2D([], [], color=COLORS[kernel], linewidth=WIDTHS[kernel], label=TITLES[kernel])
        for kernel in COLORS
        if (grid["kernel"] == kernel).any()
    ]
    handles += [
        Line2D([], [], color=GRAY, linestyle=LINES[i % len(LINES)], label=f"rate {rate:g}")
        for i, rate in enumerate(rates)
    ]
    ours: dict[str, Any] = {"color": GRAY, "marker": "o", "markerfacecolor": "white", "linestyle": ""}
    handles.append(Line2D([], [], label="row of Table IV", **ours))
    for symbol, rate in zip(PRINTED_MARKERS, rates, strict=False):
        printed: dict[str, Any] = {"color": GRAY, "marker": symbol, "linestyle": "", "markersize": 3.5}
        handles.append(Line2D([], [], label=f"paper, rate {rate:g}", **printed))
    legend_below(figure, handles, columns=3)
    return figure


def printed_accuracies(numbers: Iterable[Number], source: str) -> dict[tuple[str, float, int], float]:
    """Return the accuracies of Table IV for a source, in %, by kernel, learning rate and iterations."""
    printed = {}
    for number in numbers:
        if number.table == "IV" and number.counterpart and source in number.counterpart.sources:
            kernel, rate, iterations = number.counterpart.methods[0].split("-")
            printed[kernel, float(rate), int(iterations)] = number.value
    return printed
