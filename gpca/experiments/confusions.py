"""Confusion matrices and predicted classes of explainers, drawn for every source."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from itertools import product

import numpy as np

from gpca.attribution.metrics import ABSTAINED, PREDICTED_AS
from gpca.causes.truth import NOMINAL
from gpca.declarations.result import Figure, Frame
from gpca.errors import InputError
from gpca.reporting.figures.panels import draw_percentages
from gpca.reporting.figures.style import CONCEPT_COLORS, GRAY, LIGHT_GRAY, SMALL_PT, TEXT_WIDTH_IN, use_style

WIDEST_KEY = 3  # concepts fit into a line over the names of the explainers
LABEL_IN = 1.45  # width of the explainers' titles
HEAD_IN = 0.62
CELL_IN = 0.145  # height of a row of a matrix
MATRIX = 0.58  # share of the matrix in the width of matrix and bars
WIDE_IN = 0.19  # of a cell that holds larger numbers
FOOT_IN = 0.04
LEAST_SOURCE_IN = 1.4
LARGEST_SOURCE_IN = 1.9
LETTERS_IN = 0.14  # width of the letters left of a matrix
GAP_IN = 0.2  # between matrix and bars, and after the bars
ROW_GAP_IN = 0.1


def draw_confusions_figure(metrics: Frame, sources: Mapping[str, str], explainers: Mapping[str, str]) -> Figure:
    """Draw two panels for each explainer (rows) and source (columns), pooled over the seeds.

    The matrix is the share in % of each true concept that is taken for each concept; what is missing to 100 is
    abstained. The bars are the predicted classes' shares of all test samples, with a dash at the true share; abstained
    samples have one where any explainer abstains. `sources` and `explainers` are titles by name.
    """
    confusions = pooled_confusions(metrics)
    rows = [name for name in explainers if any((source, name) in confusions for source in sources)]
    columns = [name for name in sources if any((name, explainer) in confusions for explainer in explainers)]
    if not rows:
        raise InputError("confusions", "are of none of these explainers and sources", "collect the metrics again")
    plt = use_style()
    drawn = {key: confusions[key] for key in product(columns, rows) if key in confusions}
    concepts = list(next(iter(drawn.values())).columns[:-1])
    abstained = any(confusion[ABSTAINED].any() for confusion in drawn.values())
    source_in = float(np.clip((TEXT_WIDTH_IN - LABEL_IN) / len(columns), LEAST_SOURCE_IN, LARGEST_SOURCE_IN))
    matrix_in = MATRIX * (source_in - LETTERS_IN - 2 * GAP_IN)
    bars_in = matrix_in / MATRIX - matrix_in
    numbers_pt = SMALL_PT + (matrix_in / len(concepts) >= WIDE_IN)
    panel_in = CELL_IN * len(concepts)
    row_in = panel_in + ROW_GAP_IN
    width_in, height_in = LABEL_IN + len(columns) * source_in, HEAD_IN + len(rows) * row_in + FOOT_IN
    figure = plt.figure(figsize=(width_in, height_in))

    def text(x_in, y_in, words, ha="center", va="center", fontsize=SMALL_PT, **style):
        figure.text(x_in / width_in, 1 - y_in / height_in, words, ha=ha, va=va, fontsize=fontsize, **style)

    def panel(left_in, top_in, panel_width_in):
        corner = (left_in / width_in, 1 - (top_in + panel_in) / height_in)
        return figure.add_axes((*corner, panel_width_in / width_in, panel_in / height_in))

    top = {source: next(name for name in rows if (source, name) in confusions) for source in columns}
    for number, explainer in enumerate(rows):
        top_in = HEAD_IN + number * row_in
        title = _wrapped(explainers[explainer], LABEL_IN, 7)
        text(LABEL_IN - 0.04, top_in + panel_in / 2, title, ha="right", linespacing=1.1)
        for column, source in enumerate(columns):
            if (source, explainer) in drawn:
                left_in = LABEL_IN + column * source_in + LETTERS_IN
                confusion, head = drawn[source, explainer], explainer == top[source]
                draw_matrix(panel(left_in, top_in, matrix_in), confusion, head, numbers_pt)
                draw_bars(panel(left_in + matrix_in + GAP_IN, top_in, bars_in), confusion, head, abstained)
    for column, source in enumerate(columns):
        left_in = LABEL_IN + column * source_in + LETTERS_IN
        middle_in = left_in + (matrix_in + GAP_IN + bars_in) / 2
        text(middle_in, 0.03, _wrapped(sources[source], source_in, 8), va="top", fontsize=None, linespacing=1.1)
        text(left_in + matrix_in / 2, 0.42, "of each true (%)")
        text(left_in + matrix_in + GAP_IN + bars_in / 2, 0.42, "of all (%)")
    named = [f"{letter} {concept}" for letter, concept in zip(letters(concepts), concepts, strict=True)]
    last = ["– abstained"] if abstained else []
    key = "\n".join([", ".join(named), *last])
    if len(named) > WIDEST_KEY:
        key = f"{', '.join(named[:2])},\n{', '.join([*named[2:], *last])}"
    key = f"{key}\nmatrix: true (rows), predicted\nbars: predicted (dash: true)"
    text(0.04, 0.03, key, ha="left", va="top")
    return figure


def pooled_confusions(metrics: Frame) -> dict[tuple[str, str], Frame]:
    """(Source, explainer) -> counts over all seeds: rows true concepts; columns predicted, abstained last."""
    counts = metrics[metrics["metric"].str.startswith(PREDICTED_AS)]
    counts = counts.assign(predicted=counts["metric"].str.removeprefix(PREDICTED_AS))
    pooled = {}
    for key, rows in counts.groupby(["source", "method"], sort=False):
        table = rows.pivot_table("value", "concept", "predicted", aggfunc="sum", fill_value=0, sort=False)
        pooled[key] = table[[name for name in table.columns if name != ABSTAINED] + [ABSTAINED]]
    return pooled


def counts_and_shares(confusion: Frame) -> tuple[np.ndarray, np.ndarray]:
    """Counts (C, C) of true concepts (rows) that are taken for each (columns), and shares of the row with abstained."""
    counts_C_C1 = confusion.reindex(list(confusion.columns[:-1])).to_numpy(float)
    return counts_C_C1[:, :-1], counts_C_C1[:, :-1] / counts_C_C1.sum(axis=1, keepdims=True)


def _wrapped(title: str, width_in: float, size_pt: float) -> str:
    """Break a title into lines that fit; a letter is about half as wide as it is high."""
    letter_in = 0.48 * size_pt / 72
    return "\n".join(textwrap.wrap(title, int(width_in / letter_in), break_on_hyphens=False))


def letters(concepts: list[str]) -> list[str]:
    """Shortest capitalized beginnings that distinguish the concepts; nominal becomes OK."""
    others = {concept for concept in concepts if concept != NOMINAL}
    length = next(n for n in range(1, 99) if len({concept[:n] for concept in others}) == len(others))
    return ["OK" if concept == NOMINAL else concept[:length].capitalize() for concept in concepts]


def draw_matrix(axes, confusion: Frame, head: bool, numbers_pt: float = SMALL_PT) -> None:
    """Draw the rows' shares; a concept without samples has none. Predicted concepts are named only at the `head`."""
    concepts = list(confusion.columns[:-1])
    _, shares_C_C = counts_and_shares(confusion)
    draw_percentages(axes, 100 * shares_C_C, "{:.0f}", va="center_baseline", fontsize=numbers_pt)
    names = letters(concepts)
    axes.set_yticks(range(len(names)), names)
    axes.set_xticks(range(len(names)), names if head else [])
    axes.spines[:].set(visible=True, linewidth=0.4)
    axes.tick_params(length=0, pad=1.5, labelsize=SMALL_PT, labeltop=True, labelbottom=False)


def draw_bars(axes, confusion: Frame, head: bool, abstained: bool = True) -> None:
    """Draw the predicted classes' shares of all samples, with a dash at each concept's true share."""
    concepts = list(confusion.columns[:-1])
    names = [*letters(concepts), "–"] if abstained else letters(concepts)
    total = confusion.to_numpy().sum()
    shares = confusion.sum().iloc[: len(names)] / total
    truth = confusion.sum(axis=1) / total
    colors = [*(CONCEPT_COLORS.get(concept, GRAY) for concept in concepts), LIGHT_GRAY][: len(names)]
    axes.bar(range(len(shares)), shares, color=colors, width=0.7)
    bar_C = np.array([concepts.index(concept) for concept in truth.index])
    axes.hlines(truth, bar_C - 0.45, bar_C + 0.45, color="black", linewidth=0.6)
    axes.set(xlim=(-0.6, len(shares) - 0.4), ylim=(0, 1))
    axes.set_yticks([0, 0.5, 1], ["0", "50", "100"] if head else [])
    axes.set_xticks(range(len(shares)), names if head else [])
    axes.tick_params(length=0, pad=1.5, labelsize=SMALL_PT, labeltop=True, labelbottom=False)
    axes.tick_params(axis="y", length=1.5, labelsize=SMALL_PT)
