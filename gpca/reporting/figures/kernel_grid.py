"""Draws accuracy and confidence over iterations by kernel and learning rate, with the paper's rows marked."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gpca.errors import InputError
from gpca.reporting.figures.style import BLACK, BLUE, COLUMN_WIDTH_IN, GREY, ORANGE, save_figure, use_style
from gpca.reporting.tables.kernel_grid import PRINTED, TITLES

if TYPE_CHECKING:
    import pandas as pd

COLOURS = {"rbf": BLUE, "matern32": ORANGE, "polynomial": BLACK}
LINES: tuple[Any, ...] = ("-", (0, (4, 2)), ":", "-.")  # The largest learning rate has the first.
MEASURES = {"accuracy": "accuracy (%)", "confidence": "mean confidence (%)"}


def draw_kernel_curves(
    grid: pd.DataFrame, sources: Mapping[str, str], pdf_path: str | Path, png_path: str | Path
) -> None:
    """Draw means over the seeds; a circle is a row of the paper's Table IV.

    Args:
        grid: The frame that :func:`gpca.classifier.kernel_grid.read_grids` returns.
        sources: The title of each name, in order; those without a grid are left out.
        pdf_path, png_path: The two files to write.

    Raises:
        InputError: The grid holds none of these sources.
    """
    shown = [name for name in sources if (grid["source"] == name).any()]
    if not shown:
        raise InputError("kernels", "hold nothing of these sources", "run them first")
    use_style()
    import matplotlib.pyplot as plt
    from matplotlib.lines import Line2D
    from matplotlib.ticker import NullLocator

    height_in = 3.9
    figure, axes = plt.subplots(
        len(MEASURES), len(shown), figsize=(COLUMN_WIDTH_IN, height_in), sharex=True, sharey=True, squeeze=False
    )
    rates = sorted(grid["learning_rate"].unique(), reverse=True)
    ticks = sorted(grid["iterations"].unique())
    for column, source in enumerate(shown):
        of_source = grid[grid["source"] == source]
        means = of_source.groupby(["kernel", "learning_rate", "iterations"])[list(MEASURES)].mean()
        for row, measure in enumerate(MEASURES):
            panel = axes[row, column]
            for (kernel, rate), curve in means[measure].groupby(level=["kernel", "learning_rate"]):
                iterations = curve.index.get_level_values("iterations")
                line = LINES[rates.index(rate) % len(LINES)]
                panel.plot(iterations, 100 * curve, color=COLOURS[kernel], linestyle=line, linewidth=1.0)
            for setting in PRINTED:
                if setting in means.index:
                    marker = {"color": COLOURS[setting[0]], "markerfacecolor": "white", "markersize": 5}
                    panel.plot(setting[2], 100 * means.loc[setting, measure], "o", clip_on=False, zorder=5, **marker)
            panel.set_xscale("log")
            panel.set_xticks(ticks, [f"{tick}" for tick in ticks])
            panel.xaxis.set_minor_locator(NullLocator())
            panel.set_ylim(30, 100)
        axes[0, column].set_title(_in_two_lines(sources[source]))
        axes[-1, column].set_xlabel("iterations")
    for row, label in enumerate(MEASURES.values()):
        axes[row, 0].set_ylabel(label)
    handles = [
        Line2D([], [], color=COLOURS[kernel], label=TITLES[kernel])
        for kernel in COLOURS
        if (grid["kernel"] == kernel).any()
    ]
    handles += [
        Line2D([], [], color=GREY, linestyle=LINES[i % len(LINES)], label=f"rate {rate:g}")
        for i, rate in enumerate(rates)
    ]
    circle: dict[str, Any] = {"color": GREY, "marker": "o", "markerfacecolor": "white", "linestyle": ""}
    handles.append(Line2D([], [], label="printed row", **circle))
    figure.legend(handles=handles, ncol=3, loc="lower center", columnspacing=1.2, handlelength=1.8)
    figure.tight_layout(rect=(0, 0.34 / height_in, 1, 1), pad=0.4, h_pad=0.8)
    save_figure(figure, pdf_path, png_path)


def _in_two_lines(title: str) -> str:
    """Break a title before its first bracket."""
    return title.replace(" (", "\n(")
