"""Draws one registration with the estimators' ellipses of its pose over the results of the reference."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gpca.experiments.estimators.covariances import ReferenceSamples, covariance_of
from gpca.experiments.estimators.settings import REFERENCES
from gpca.reporting.figures.style import (
    BLACK,
    BLUE,
    GRAY,
    GREEN,
    LIGHT_GRAY,
    ORANGE,
    PURPLE,
    SKY_BLUE,
    VERMILION,
    YELLOW,
)

STYLES: dict[str, tuple[str, Any]] = {  # An estimator has a color and a line everywhere in the figure.
    "reference_starts": (GRAY, (0, (1, 1))),
    "reference_data": (GRAY, (0, (4, 1.5))),
    "reference_all": (GRAY, "-"),
    "monte_carlo": (BLACK, "-"),
    "censi": (VERMILION, "-"),
    "bonnabel": (VERMILION, (0, (1, 1))),
    "brossard": (BLUE, "-"),
    "bayesian_icp": (ORANGE, "-"),
    "stein_icp": (SKY_BLUE, (0, (4, 1.5))),
    "cello": (GREEN, "-"),
    "learned": (PURPLE, "-"),
}
_OTHER = (YELLOW, "-")
TURN = np.linspace(0, 2 * np.pi, 181)
PLANE = 95.0  # percent that an ellipse holds
WIDEST = 2.0  # An ellipse may make a panel this many times as wide as dots and true pose do; a wider one is left out.


def style_of(name: str) -> tuple[str, Any]:
    """Return the color and the line of an estimator."""
    return STYLES.get(name, _OTHER)


def ellipse(covariance_2_2: np.ndarray) -> np.ndarray:
    """Return the outline (n, 2) of the ellipse that holds `PLANE` percent of a Gaussian about zero."""
    values_2, axes_2_2 = np.linalg.eigh(covariance_2_2)
    radius = np.sqrt(-2 * np.log(1 - PLANE / 100))
    return radius * np.column_stack([np.cos(TURN), np.sin(TURN)]) * np.sqrt(np.maximum(values_2, 0)) @ axes_2_2.T


def draw_ellipses(
    panel, samples: ReferenceSamples, place: int, estimates: Mapping, block: slice, factor: float
) -> list[str]:
    """Draw one registration in the plane in which the results of other starts and data spread most.

    Returns the estimators whose ellipses are far wider than the results and are therefore left out.

    Args:
        panel: the matplotlib axes.
        samples: the references' results.
        place: the row in the samples of the registration and of that reference.
        estimates: estimator -> its row about the registration, None where it has none.
        block: the numbers of a twist that are drawn, rotation or translation.
        factor: their factor to the panel's unit.
    """
    twists_n_3 = factor * samples.twists_of(place)[:, block]
    values_3, axes_3_3 = np.linalg.eigh(np.cov(twists_n_3, rowvar=False))
    plane_3_2 = axes_3_3[:, ::-1][:, :2]
    dots_n_2, true_2 = twists_n_3 @ plane_3_2, factor * samples.true_twist[place, block] @ plane_3_2
    panel.scatter(*dots_n_2.T, s=1.2, color=LIGHT_GRAY, linewidths=0, rasterized=True, zorder=1)
    reach = max(np.quantile(np.abs(dots_n_2), 0.985), 2.6 * np.sqrt(max(values_3[-1], 0)), *np.abs(true_2))
    most, left_out = WIDEST * reach, []
    for name, row in estimates.items():
        if row is None:
            continue
        outline_n_2 = ellipse(factor**2 * plane_3_2.T @ covariance_of(row)[block, block] @ plane_3_2)
        if (widest := np.abs(outline_n_2).max()) > most:
            left_out.append(name)
            continue
        reach = max(reach, widest)
        color, line = style_of(name)
        look = {"linewidth": 1.8, "zorder": 2} if name in REFERENCES else {"linewidth": 0.9, "zorder": 3}
        panel.plot(*outline_n_2.T, color=color, linestyle=line, **look)
    panel.plot(*true_2, marker="*", color=BLACK, markersize=7, markeredgecolor="white", markeredgewidth=0.5, zorder=4)
    panel.set(xlim=(-1.05 * reach, 1.05 * reach), ylim=(-1.05 * reach, 1.05 * reach), aspect="equal")
    panel.locator_params(nbins=4)
    panel.tick_params(pad=1.5, length=2)
    return left_out
