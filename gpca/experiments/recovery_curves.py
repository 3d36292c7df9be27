"""Figures of recovery: rates by policy, what the allowed error and the costs decide, and labels of queued cases."""

from collections.abc import Mapping
from math import nan
from typing import Any

import numpy as np

from gpca.causes.policy import DOUBTED, DRAWN
from gpca.declarations.plan import Run
from gpca.declarations.result import Figure, Frame, figure
from gpca.errors import InputError
from gpca.evaluation.intervals import wilson_interval
from gpca.experiments.recovery import SECTION, policy_titles, tables_title
from gpca.experiments.recovery_measures import at, pool_share, read_queues
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures import style
from gpca.reporting.figures.panels import legend_below, panels
from gpca.reporting.words import plural

METRICS = {"metrics": "recovery.csv"}
ROW_IN = 0.33  # with less, the markers of one policy overlap
APART = 0.26  # of a row
SHADES = (style.SKY_BLUE, style.BLUE, style.BLACK)  # grows darker with every action
ORDERS = {
    DOUBTED: ("in doubt first, as a queue gives them", style.BLUE, "-"),
    DRAWN: ("drawn at random", style.GRAY, "--"),
}
Look = tuple[str, Any]  # color and line
ALARMED: dict[str, Look] = {  # policies that are given that the pose is wrong
    "gpca_acting": (style.BLUE, "-"),
    "utility_acting": (style.GREEN, "-"),
    "error_only_acting": (style.VERMILION, "-"),
    "reenact": (style.PURPLE, "-"),
    "random": (style.GRAY, ":"),
    "oracle": (style.BLACK, (0, (4, 2))),
}
ALONE: dict[str, Look] = {  # policies that have to recognize failures themselves
    "gpca": (style.BLUE, ":"),
    "gpca_gated": (style.BLUE, "-"),
    "utility": (style.GREEN, ":"),
    "utility_gated": (style.GREEN, "-"),
    "error_only": (style.VERMILION, "-"),
    "error_only_reenact": (style.VERMILION, ":"),
    "reenact_gated": (style.PURPLE, "-"),
}
ALWAYS: Look = (style.ORANGE, (0, (4, 2)))  # the best of the sequences
FACTORS = np.geomspace(0.3, 3, 21)  # on the costs of all actions
FAILED = (0.5, 0.1)  # shares of the registrations
LOSSES = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)  # that the axis names


@figure(
    SECTION,
    "Recovery over actions",
    """The share of failures that each policy recovers within one, two and more actions, with its Wilson interval (95
    %). On the right, the share within all actions, by cause, of n failures each. The oracle knows the cause.""",
    **METRICS,
)
def recovery_rates(run: Run, metrics: Frame) -> Figure:
    budget, policies = run.config["recovery"]["loop"]["budget"], policy_titles(run.config)
    shown = _with_rates(metrics, policies)
    drawing, [axes] = panels(1, 2, 0.75 + ROW_IN * len(shown), sharey=True, width_ratios=(1.5, 1))
    for k in range(1, budget + 1):
        offset = APART * (k - (budget + 1) / 2)
        look = {"color": SHADES[(k - 1) % len(SHADES)], "marker": "o", "label": f"within {plural(k, 'action')}"}
        _draw(axes[0], metrics, shown, f"recovered_within_{k}", "all", offset, look)
    for n, cause in enumerate(CONCEPTS):
        _, failures = pool_share(metrics, shown[0], f"recovered_within_{budget}", cause) or (nan, 0)
        label = f"{cause} ($n$ = {failures})"
        look = {"color": style.CONCEPT_COLORS[cause], "marker": style.CONCEPT_MARKERS[cause], "label": label}
        _draw(axes[1], metrics, shown, f"recovered_within_{budget}", cause, APART * (n - 1), look)
    axes[0].set_yticks(range(len(shown)), [policies[name] for name in shown])
    axes[0].set_ylim(len(shown) - 0.4, -0.6)
    for panel in axes:
        panel.set_xlim(-2, 102)
        panel.set_xlabel("recovered (%)")
        panel.grid(axis="x")
        panel.set_axisbelow(True)
        panel.tick_params(axis="y", length=0)
        spacing = {"handletextpad": 0.2, "columnspacing": 1.0, "borderpad": 0}
        panel.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, **spacing)
    _, episodes = pool_share(metrics, shown[0], "recovered_within_1") or (nan, 0)
    style.write_title(drawing, f"{tables_title(run)}: {episodes} failures; right: within {budget} actions, by cause")
    return drawing


def _draw(axes, metrics, shown, metric: str, concept: str, offset: float, look: Mapping[str, str]) -> None:
    """Rates of one kind, a little above or below the middle of each policy's row, with their intervals."""
    rates = {row: r for row, name in enumerate(shown) if (r := pool_share(metrics, name, metric, concept))}
    for row, (share, trials) in rates.items():
        low, high = wilson_interval(share * trials, trials)
        axes.plot([100 * low, 100 * high], [row + offset] * 2, color=look["color"], linewidth=0.8)
    shares = [100 * share for share, _ in rates.values()]
    axes.plot(shares, [row + offset for row in rates], linestyle="", markersize=3.5, **look)


@figure(
    SECTION,
    "Recovery by the error that is allowed",
    """The share of failures that each policy recovers within one, two and more actions, over the error below which a
    pose is right, of the failures by that limit. The dotted line is the run's own limit; a policy that stopped there
    might have gone on by a narrower one, so shares to its left are lower bounds.""",
    **METRICS,
)
def recovery_thresholds(run: Run, metrics: Frame) -> Figure:
    budget, success = run.config["recovery"]["loop"]["budget"], run.config["success"]
    policies, curve = policy_titles(run.config), success["curve"]
    shown = _shown(metrics, policies, ALARMED, budget)
    drawing, [drawn] = panels(1, budget, 2.6, sharex=True, sharey=True)
    for k, panel in enumerate(drawn, start=1):
        for name, (color, line) in shown.items():
            shares = [pool_share(metrics, name, at(f"recovered_within_{k}", limit)) for limit in curve]
            points = [(100 * limit, 100 * share[0]) for limit, share in zip(curve, shares, strict=True) if share]
            look = {"color": color, "linestyle": line, "linewidth": 1.4, "marker": "o", "markersize": 3}
            panel.plot(*zip(*points, strict=True), label=policies[name], **look)
        panel.axvline(100 * success["error"], color=style.LIGHT_GRAY, linestyle=":", zorder=0)
        panel.set_xscale("log")
        panel.set_xticks([100 * limit for limit in curve], [f"{100 * limit:g}" for limit in curve])
        panel.minorticks_off()
        panel.set(title=f"within {plural(k, 'action')}", ylim=(-2, 102), xlabel="error allowed (% of the diameter)")
    drawn[0].set_ylabel("recovered (%)")
    legend_below(drawing, drawn[0].get_legend_handles_labels()[0], columns=3)
    counts = [pool_share(metrics, next(iter(shown)), at("recovered_within_1", limit)) for limit in curve]
    of = ", ".join(f"{count[1]} at {100 * limit:g} %" for limit, count in zip(curve, counts, strict=True) if count)
    style.write_title(drawing, f"{tables_title(run)}: failures: {of}")
    return drawing


@figure(
    SECTION,
    "What policies cost",
    """The mean loss per registration, where a wrong pose that stays costs 1, each action what the config says times the
    factor, and an action on a good pose the config's `needless` besides. Policies act as they do at the config's own
    costs, factor 1. A sequence without a gate acts on everything; a queued case counts as not recovered.""",
    **METRICS,
)
def recovery_costs(run: Run, metrics: Frame) -> Figure:
    from matplotlib.ticker import FixedLocator

    recovery, policies = run.config["recovery"], policy_titles(run.config)
    budget, needless = recovery["loop"]["budget"], recovery["needless"]
    shown = _shown(metrics, policies, ALONE, budget)
    drawing, [drawn] = panels(1, len(FAILED), 2.8, sharex=True, sharey=True)
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
    legend_below(drawing, drawn[0].get_legend_handles_labels()[0], columns=3)
    style.write_title(drawing, tables_title(run))
    return drawing


def losses(
    metrics: Frame, policy: str, budget: int, needless: float, failed: float, factor_F: np.ndarray
) -> np.ndarray:
    """Mean loss (F,) of a policy's registrations, of which a share has failed, by the factor on costs.

    It is failed · (1 − recovered + factor · cost) + (1 − failed) · (acted · needless + factor · cost of the good).
    """
    recovered, cost, acted, cost_nominal = (
        share[0] if (share := pool_share(metrics, policy, name)) else 0.0
        for name in (f"recovered_within_{budget}", "cost", "acted_nominal", "cost_nominal")
    )
    return failed * (1 - recovered + factor_F * cost) + (1 - failed) * (acted * needless + factor_F * cost_nominal)


def _shown(metrics: Frame, policies: Mapping[str, str], looks: Mapping[str, Look], budget: int) -> dict[str, Look]:
    """Look of every policy that is drawn: those with one of their own, and the best fixed sequence."""
    present = _with_rates(metrics, policies)
    shown = {name: look for name, look in looks.items() if name in present}
    sums = {  # of the recoveries within 1, 2, … actions
        name: sum((pool_share(metrics, name, f"recovered_within_{k}") or (0.0,))[0] for k in range(1, budget + 1))
        for name in present
        if name.startswith(("sequence_", "always_"))
    }
    return shown | ({max(sums, key=sums.__getitem__): ALWAYS} if sums else {})


def _with_rates(metrics: Frame, policies: Mapping[str, str]) -> list[str]:
    shown = [name for name in policies if pool_share(metrics, name, "recovered_within_1")]
    if not shown:
        raise InputError("metrics", "have no recovery rates", "run the step recover first")
    return shown


@figure(
    SECTION,
    "What queued cases teach",
    """The share of failures that remain after a policy's first action, over the number of queued cases that it has
    learned from a person's labels: the most doubtful first, or in random order (mean of five orders). The queued
    failures come from tables of their own, and the policy is judged on those of Table VIII. Bands are Wilson's (95 %),
    as if each failure were judged once.""",
    needs=("learning_policy",),
    queues=(read_queues, "recovery/queue_seed{seed}.csv"),
)
def queued_labels(run: Run, queues: Frame) -> Figure:
    policies = policy_titles(run.config)
    shown = [name for name in policies if (queues["policy"] == name).any()]
    highest = 100 * queues[queues["policy"].isin(shown)]["high"].max()
    drawing, [drawn] = panels(1, len(shown), 2.4, sharex=True, sharey=True)
    for panel, policy in zip(drawn, shown, strict=True):
        for order, (words, color, line) in ORDERS.items():
            curve = queues[(queues["policy"] == policy) & (queues["order"] == order)].sort_values("labels")
            panel.plot(curve["labels"], 100 * curve["error"], line, color=color, label=words, linewidth=1.4)
            bounds = (100 * curve[name] for name in ("low", "high"))
            panel.fill_between(curve["labels"], *bounds, color=color, alpha=0.15, linewidth=0)
        panel.set_title(policies[policy])
        panel.set_xlabel("queued cases labeled, per seed")
        panel.set_ylim(0, min(100, 1.05 * highest))
        panel.margins(x=0.01)
        panel.xaxis.get_major_locator().set_params(integer=True)
    drawn[0].set_ylabel("not solved by the first action (%)")
    legend_below(drawing, *drawn[0].get_legend_handles_labels())
    style.write_title(drawing, f"{tables_title(run)}: judged on {int(queues['failures'].max())} failures")
    return drawing
