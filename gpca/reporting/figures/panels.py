"""Figures of many small panels with shared axes, one legend and one title."""

from __future__ import annotations

from pathlib import Path
from textwrap import wrap

from gpca.reporting.figures.style import TEXT_WIDTH_IN, save_figure, use_style, write_title

MOST_PER_ROW = 5


def small_panels(count: int, panel_height_in: float):
    """Return a figure with that many panels, their axes shared, and the panels; rows are as even as they can be."""
    plt = use_style()
    lines = -(-count // MOST_PER_ROW)
    size = (TEXT_WIDTH_IN, 0.75 + panel_height_in * lines)
    figure, axes = plt.subplots(lines, -(-count // lines), figsize=size, sharex=True, sharey=True, squeeze=False)
    for spare in axes.flat[count:]:
        spare.set_visible(False)
    return figure, list(axes.flat[:count])


def finish_panels(
    figure,
    panels: list,
    title: str,
    handles: list,
    labels: list[str],
    across: str,
    up: str,
    pdf_path: str | Path,
    png_path: str | Path,
) -> None:
    """Label the outer panels, set a title above all and a legend below, and write the figure."""
    height_in = figure.get_size_inches()[1]
    per_row = panels[0].get_gridspec().ncols
    for i, panel in enumerate(panels):
        if i % per_row == 0:
            panel.set_ylabel(up)
        if i + per_row >= len(panels):
            panel.set_xlabel(across)
            panel.tick_params(labelbottom=True)
    figure.legend(handles, labels, ncol=len(labels), loc="lower center", columnspacing=1.4)
    write_title(figure, title)
    figure.tight_layout(rect=(0.012, 0.2 / height_in, 1, 1 - 0.2 / height_in), pad=0.4, h_pad=0.8, w_pad=0.6)
    save_figure(figure, pdf_path, png_path)


def in_lines(title: str, letters: int = 26) -> str:
    """Return the title with what stands in brackets in a line of its own, and no line much longer than `letters`."""
    return "\n".join(line for part in title.replace(" (", "\n(").split("\n") for line in wrap(part, letters))
