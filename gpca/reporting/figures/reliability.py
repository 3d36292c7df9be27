"""Draws whether a probability can be believed: how often the predicted outcome came true."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from gpca.evaluation.intervals import wilson_interval
from gpca.reporting.figures.panels import MOST_PER_ROW, label_outer, legend_below, panels_in_lines
from gpca.reporting.figures.style import BLUE, GRAY, LIGHT_GRAY, SMALL_PT, TEXT_WIDTH_IN, write_title

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FEWEST = 5  # samples of a bin that has a point
HEADROOM = 2.0  # height of the axis of the numbers, in those of the highest bar


def reliability_figure(
    samples: Mapping[str, tuple[np.ndarray, np.ndarray]],
    title: str,
    bins: int,
    across: str = "largest score",
    up: str = "accuracy",
    label: str = "accuracy",
    least: float = 0.0,
) -> Figure:
    """Return a figure with a panel for each entry, and the calibration error of its samples in the panel's title.

    Samples are, by the words above their panel, probabilities from `least` on, and whether each came true.
    """
    lines = -(-len(samples) // MOST_PER_ROW)
    square_in = TEXT_WIDTH_IN / -(-len(samples) // lines) - 0.42
    figure, panels = panels_in_lines(len(samples), min(square_in, 1.6) + 0.42)
    for panel, (words, (probability_S, true_S)) in zip(panels, samples.items(), strict=True):
        gap = draw_reliability_panel(panel, probability_S, true_S, bins, f"{label}, 95 % interval")
        panel.set_title(f"{words}\npooled ECE {gap:.3f}", fontsize=SMALL_PT)
        if least:
            panel.set_xlim(least - 0.03, 1.02)
            panel.set_xticks([0.4, 0.6, 0.8, 1.0], ["0.4", "0.6", "0.8", "1"])
    label_outer(panels, across, up)
    legend_below(figure, *panels[0].get_legend_handles_labels())
    write_title(figure, title)
    return figure


def draw_reliability_panel(
    panel, probability_S: np.ndarray, true_S: np.ndarray, bins: int, label: str = "accuracy"
) -> float:
    """Draw the share that came true and its Wilson interval (95 %) by bin; return the expected calibration error.

    The panel is square, and its diagonal calibrated. The numbers of samples are bars with an axis at the right.
    """
    bin_S = np.minimum((probability_S * bins).astype(int), bins - 1)
    counts_B = np.bincount(bin_S, minlength=bins)
    drawn = counts_B >= FEWEST
    hits_B = np.bincount(bin_S, weights=true_S, minlength=bins)[drawn]
    true_B = hits_B / counts_B[drawn]
    mean_B = np.bincount(bin_S, weights=probability_S, minlength=bins)[drawn] / counts_B[drawn]
    centers_B = (np.arange(bins) + 0.5) / bins
    counts = panel.twinx()
    counts.bar(centers_B, counts_B, width=1 / bins, color=LIGHT_GRAY)
    counts.set_yscale("log")
    most = 10 ** np.ceil(np.log10(counts_B.max()))
    counts.set_ylim(0.8, 0.8 * (most / 0.8) ** HEADROOM)
    counts.set_yticks([10**power for power in range(int(np.log10(most)) + 1)])
    counts.yaxis.set_major_formatter("{x:g}")
    counts.minorticks_off()
    counts.tick_params(colors=GRAY, length=2, pad=1)
    counts.set_zorder(panel.get_zorder() - 1)
    panel.patch.set_visible(False)
    panel.bar(0.5, 0, color=LIGHT_GRAY, label="samples (right axis)")
    panel.plot([0, 1], [0, 1], color=GRAY, linewidth=0.6, linestyle=(0, (4, 3)), label="calibrated")
    bounds_B_2 = [wilson_interval(hits, count) for hits, count in zip(hits_B, counts_B[drawn], strict=True)]
    panel.vlines(mean_B, *np.reshape(bounds_B_2, (-1, 2)).T, color=BLUE, linewidth=0.7)
    panel.plot(mean_B, true_B, "o-", color=BLUE, markersize=2.5, linewidth=1.0, label=label)
    panel.set(xlim=(0, 1.02), ylim=(0, 1.02), box_aspect=1)
    counts.set_box_aspect(1)
    panel.set_xticks([0, 0.5, 1], ["0", "0.5", "1"])
    panel.set_yticks([0, 0.5, 1], ["0", "0.5", "1"])
    return float(np.abs(np.bincount(bin_S, weights=probability_S - true_S, minlength=bins)).sum() / len(true_S))
