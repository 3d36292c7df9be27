"""Draws recovery rates: the share of failures that each policy recovers within 1, 2, … actions."""

from __future__ import annotations

from collections.abc import Mapping
from math import nan
from typing import TYPE_CHECKING

from gpca.attribution.confidence import wilson_interval
from gpca.errors import InputError
from gpca.experiments.recovery.metrics import pool_share
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures.panels import panels
from gpca.reporting.figures.style import BLACK, BLUE, CONCEPT_COLORS, CONCEPT_MARKERS, SKY_BLUE, write_title
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

ROW_IN = 0.33  # In less, the markers of one policy overlap.
APART = 0.26  # of a row
SHADES = (SKY_BLUE, BLUE, BLACK)  # The shade grows darker with every action.


def draw_recovery_rates(metrics: pd.DataFrame, title: str, policies: Mapping[str, str], budget: int) -> Figure:
    """Draw (left) the rate within 1 to `budget` actions with its Wilson interval, (right) that within all by cause.

    Args:
        metrics: The tidy metrics that :func:`gpca.experiments.recovery.metrics.collect_recovery` makes.
        policies: The title of each name, from top to bottom; those without numbers are left out.
        budget: The number of actions that a policy may take.
    """
    shown = [name for name in policies if pool_share(metrics, name, "recovered_within_1") is not None]
    if not shown:
        raise InputError("metrics", "have no recovery rates", "run the step recover first")
    figure, [axes] = panels(1, 2, 0.75 + ROW_IN * len(shown), sharey=True, width_ratios=(1.5, 1))
    for k in range(1, budget + 1):
        offset = APART * (k - (budget + 1) / 2)
        look = {"color": SHADES[(k - 1) % len(SHADES)], "marker": "o", "label": f"within {plural(k, 'action')}"}
        _draw(axes[0], metrics, shown, f"recovered_within_{k}", "all", offset, look)
    for n, cause in enumerate(CONCEPTS):
        _, failures = pool_share(metrics, shown[0], f"recovered_within_{budget}", cause) or (nan, 0)
        label = f"{cause} ($n$ = {failures})"
        look = {"color": CONCEPT_COLORS[cause], "marker": CONCEPT_MARKERS[cause], "label": label}
        _draw(axes[1], metrics, shown, f"recovered_within_{budget}", cause, APART * (n - 1), look)
    axes[0].set_yticks(range(len(shown)), [policies[name] for name in shown])
    axes[0].set_ylim(len(shown) - 0.4, -0.6)
    for panel in axes:
        panel.set_xlim(-2, 102)
        panel.set_xlabel("recovered (%)")
        panel.grid(axis="x")
        panel.set_axisbelow(True)
        panel.tick_params(axis="y", length=0)
        panel.legend(
            loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, handletextpad=0.2, columnspacing=1.0, borderpad=0
        )
    _, episodes = pool_share(metrics, shown[0], "recovered_within_1") or (nan, 0)
    write_title(figure, f"{title}: {episodes} failures; right: within {budget} actions, by cause")
    return figure


def _draw(axes, metrics, shown, metric: str, concept: str, offset: float, look: Mapping[str, str]) -> None:
    """Draw the rates of one kind, a little above or below the middle of each policy's row, with their intervals."""
    found = {row: pool_share(metrics, name, metric, concept) for row, name in enumerate(shown)}
    rates = {row: rate for row, rate in found.items() if rate is not None}
    for row, (share, trials) in rates.items():
        low, high = wilson_interval(share * trials, trials)
        axes.plot([100 * low, 100 * high], [row + offset] * 2, color=look["color"], linewidth=0.8)
    shares = [100 * share for share, _ in rates.values()]
    axes.plot(shares, [row + offset for row in rates], linestyle="", markersize=3.5, **look)
