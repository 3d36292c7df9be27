"""Draws what the settings decide: recovery over the error that is allowed, and the loss over the cost of actions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.errors import InputError
from gpca.experiments.recovery.metrics import at, pool_share
from gpca.reporting.figures.panels import legend_below, panels
from gpca.reporting.figures.style import (
    BLACK,
    BLUE,
    GRAY,
    GREEN,
    LIGHT_GRAY,
    ORANGE,
    PURPLE,
    VERMILION,
    write_title,
)
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

Look = tuple[str, Any]  # color and line
TOLD: dict[str, Look] = {  # policies that are told that the pose is wrong
    "gpca_acting": (BLUE, "-"),
    "utility_acting": (GREEN, "-"),
    "error_only_acting": (VERMILION, "-"),
    "reenact": (PURPLE, "-"),
    "random": (GRAY, ":"),
    "oracle": (BLACK, (0, (4, 2))),
}
ALONE: dict[str, Look] = {  # policies that have to recognize failures themselves
    "gpca": (BLUE, ":"),
    "gpca_gated": (BLUE, "-"),
    "utility": (GREEN, ":"),
    "utility_gated": (GREEN, "-"),
    "error_only": (VERMILION, "-"),
    "error_only_reenact": (VERMILION, ":"),
    "reenact_gated": (PURPLE, "-"),
}
ALWAYS: Look = (ORANGE, (0, (4, 2)))  # the best of the sequences
FACTORS = np.geomspace(0.3, 3, 21)  # on the costs of all actions
FAILED = (0.5, 0.1)  # shares of the registrations
LOSSES = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)  # that the axis names


def draw_recovery_thresholds(
    metrics: pd.DataFrame,
    title: str,
    policies: Mapping[str, str],
    budget: int,
    curve: Sequence[float],
    success: float,
) -> Figure:
    """Draw a panel for each number of actions: the share recovered over the error below which a pose is right.

    Args:
        metrics: The tidy metrics that :func:`gpca.experiments.recovery.metrics.collect_recovery` makes.
        policies: The title of each name.
        curve: The errors, in diameters.
        success: The run's own.
    """
    shown = _shown(metrics, policies, TOLD, budget)
    figure, [drawn] = panels(1, budget, 2.6, sharex=True, sharey=True)
    for k, panel in enumerate(drawn, start=1):
        for name, (color, line) in shown.items():
            shares = [pool_share(metrics, name, at(f"recovered_within_{k}", limit)) for limit in curve]
            points = [(100 * limit, 100 * share[0]) for limit, share in zip(curve, shares, strict=True) if share]
            look = {"color": color, "linestyle": line, "linewidth": 1.4, "marker": "o", "markersize": 3}
            panel.plot(*zip(*points, strict=True), label=policies[name], **look)
        panel.axvline(100 * success, color=LIGHT_GRAY, linestyle=":", zorder=0)
        panel.set_xscale("log")
        panel.set_xticks([100 * limit for limit in curve], [f"{100 * limit:g}" for limit in curve])
        panel.minorticks_off()
        panel.set(title=f"within {plural(k, 'action')}", ylim=(-2, 102), xlabel="error allowed (% of the diameter)")
    drawn[0].set_ylabel("recovered (%)")
    handles, labels = drawn[0].get_legend_handles_labels()
    legend_below(figure, handles, labels, 3)
    counts = [pool_share(metrics, next(iter(shown)), at("recovered_within_1", limit)) for limit in curve]
    of = ", ".join(f"{count[1]} at {100 * limit:g} %" for limit, count in zip(curve, counts, strict=True) if count)
    write_title(figure, f"{title}: failures: {of}")
    return figure


def draw_recovery_costs(
    metrics: pd.DataFrame, title: str, policies: Mapping[str, str], budget: int, needless: float
) -> Figure:
    """Draw the loss over the factor on the costs of actions, a panel for each share of failures.

    Args:
        needless: What it costs to act on a good registration, besides the action.
    """
    shown = _shown(metrics, policies, ALONE, budget)
    from matplotlib.ticker import FixedLocator

    figure, [drawn] = panels(1, len(FAILED), 2.8, sharex=True, sharey=True)
    for panel, failed in zip(drawn, FAILED, strict=True):
        for name, (color, line) in shown.items():
            loss_F = losses(metrics, name, budget, needless, failed, FACTORS)
            panel.plot(FACTORS, loss_F, color=color, linestyle=line, linewidth=1.4, label=policies[name])
        panel.set(xscale="log", yscale="log", xlabel="factor on the costs of actions")
        panel.set_title(f"{100 * failed:.0f} % have failed")
        panel.yaxis.set_major_locator(FixedLocator(LOSSES))
        panel.yaxis.set_major_formatter("{x:g}")
        panel.set_xticks([0.3, 1, 3], ["0.3", "1", "3"])
        panel.minorticks_off()
    drawn[0].set_ylabel("loss per registration")
    handles, labels = drawn[0].get_legend_handles_labels()
    legend_below(figure, handles, labels, 3)
    write_title(figure, title)
    return figure


def losses(
    metrics: pd.DataFrame, policy: str, budget: int, needless: float, failed: float, factor_F: np.ndarray
) -> np.ndarray:
    """Return the mean loss (F,) of a policy's registrations, of which a share has failed, by the factor on costs.

    It is failed · (1 − recovered + factor · cost) + (1 − failed) · (acted · needless + factor · cost of the good).
    """
    recovered, cost, acted, cost_nominal = (
        share[0] if (share := pool_share(metrics, policy, name)) else 0.0
        for name in (f"recovered_within_{budget}", "cost", "acted_nominal", "cost_nominal")
    )
    of_failures = 1 - recovered + factor_F * cost
    return failed * of_failures + (1 - failed) * (acted * needless + factor_F * cost_nominal)


def _shown(
    metrics: pd.DataFrame, policies: Mapping[str, str], looks: Mapping[str, Look], budget: int
) -> dict[str, Look]:
    """Return the look of every policy that is drawn: those with one of their own, and the best fixed sequence."""
    whole = f"recovered_within_{budget}"
    shares = {name: share[0] for name in policies if (share := pool_share(metrics, name, whole))}
    if not shares:
        raise InputError("metrics", "have no recovery rates", "run the step recover first")
    shown = {name: look for name, look in looks.items() if name in shares}
    return shown | dict.fromkeys(_best_sequence(metrics, shares, budget), ALWAYS)


def _best_sequence(metrics: pd.DataFrame, shares: Iterable[str], budget: int) -> list[str]:
    """Return the fixed sequence with the most recoveries within 1, 2, … actions, summed; none where there is none."""
    fixed = [name for name in shares if name.startswith(("sequence_", "always_"))]
    sums = {
        name: sum((pool_share(metrics, name, f"recovered_within_{k}") or (0.0,))[0] for k in range(1, budget + 1))
        for name in fixed
    }
    return [max(fixed, key=sums.__getitem__)] if fixed else []
