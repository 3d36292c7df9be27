"""Bars of concept scores, which several figures show beside a sample."""

from collections.abc import Sequence

import numpy as np

from gpca.declarations.result import Series
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures.style import CONCEPT_COLORS, SMALL_PT


def draw_scores(axes, row: Series) -> None:
    """Draw a sample's concept scores as bars with ± one standard deviation, the true concept's name in bold."""
    deviations = [np.sqrt(row[f"variance_{concept}"]) for concept in CONCEPTS]
    draw_score_bars(axes, [row[f"score_{concept}"] for concept in CONCEPTS], row["concept_true"], deviations)
    axes.set(xlim=(0, 1))
    axes.set_xticks([0, 0.5, 1], ["0", "0.5", "1"])


def draw_score_bars(
    axes, scores_C: Sequence[float], true_concept: str, deviations_C: Sequence[float] | None = None
) -> None:
    """Draw a bar for each concept from top to bottom, without axis at the left, the true concept's name in bold."""
    for place, concept in enumerate(CONCEPTS):
        deviation = None if deviations_C is None else deviations_C[place]
        look = {"color": CONCEPT_COLORS[concept], "height": 0.7, "error_kw": {"lw": 0.8}}
        axes.barh(place, scores_C[place], xerr=deviation, **look)
        weight = "bold" if concept == true_concept else "normal"
        axes.text(-0.03, place, concept, ha="right", va="center", fontsize=SMALL_PT, fontweight=weight)
    axes.set(ylim=(len(CONCEPTS) - 0.4, -0.6), yticks=[])
    axes.spines["left"].set_visible(False)
