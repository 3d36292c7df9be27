"""Lays out figures of one panel or many: room for all that stands around the panels is found automatically."""

from textwrap import wrap

import numpy as np

from gpca.reporting.figures.style import SMALL_PT, TEXT_WIDTH_IN, blues, use_style

LETTERS_PER_IN, LETTERS_OF_SIGN = 18, 8  # of a legend, and those that a sign before a label takes the room of


def panels(rows: int, columns: int, height_in: float, width_in: float = TEXT_WIDTH_IN, **options):
    """Return a figure and its panels (rows, columns); the options are those of ``pyplot.subplots``."""
    size = (width_in, height_in)
    return use_style().subplots(rows, columns, figsize=size, squeeze=False, layout="constrained", **options)


def legend_below(figure, handles: list, labels: list[str] | None = None, columns: int = 0, **style) -> None:
    """Name lines and markers below all panels, in columns, or in one line where the figure is wide enough for it."""
    labels = [handle.get_label() for handle in handles] if labels is None else labels
    columns = columns or fitting_columns(labels, figure.get_figwidth())
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, columnspacing=1.4, **style)


def fitting_columns(labels: list[str], width_in: float) -> int:
    """Return how many columns of a legend fit a width: all labels in one line, or fewer of the longest label each."""
    room = LETTERS_PER_IN * width_in
    if sum(len(label) + LETTERS_OF_SIGN for label in labels) <= room:
        return len(labels)
    longest = max(len(label) for label in labels) + LETTERS_OF_SIGN
    most = max(1, min(len(labels), int(room // longest)))
    return -(-len(labels) // -(-len(labels) // most))  # as even as they can be


def draw_percentages(panel, percentages: np.ndarray, form: str, counts: np.ndarray | None = None, **style) -> None:
    """Draw a matrix in blues and write the number of every cell into it; a NaN has neither.

    The form of the numbers is like ``{:.0f}``; a second pair of braces holds the count of the cell.
    """
    panel.imshow(np.ma.masked_invalid(percentages), cmap=blues(), vmin=0, vmax=100, aspect="auto")
    for cell, percentage in np.ndenumerate(percentages):
        if np.isfinite(percentage):
            words = form.format(percentage, None if counts is None else counts[cell])
            look = {"ha": "center", "va": "center", "fontsize": SMALL_PT, "color": color_on_blue(percentage / 100)}
            panel.text(cell[1], cell[0], words, **look | style)


def color_on_blue(share: float) -> str:
    """Return the color of letters on a shade of blue between 0, which is white, and 1."""
    return "white" if share > 0.65 else "black"


def write_below(panel, words: str, **style) -> None:
    """Write a caption below a panel, which may be one without axes."""
    panel.set_title(words, **{"y": 0, "pad": -4, "va": "top", "linespacing": 1.15} | style)


def in_lines(title: str, letters: int = 26) -> str:
    """Return the title with what stands in brackets in a line of its own, and no line much longer than `letters`."""
    parts = title.replace(" (", "\n(").split("\n")
    return "\n".join(line for part in parts for line in wrap(part, letters, break_on_hyphens=False))
