"""Draws what recovery achieves: rates of each policy, the worth of labels of queued cases, the robot's policy."""

from __future__ import annotations

import json
from collections.abc import Mapping
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.errors import InputError
from gpca.evaluation.intervals import wilson_interval
from gpca.experiments.recovery.metrics import DOUBTED, DRAWN, pool_share
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures.diagram import Canvas
from gpca.reporting.figures.panels import legend_below, panels
from gpca.reporting.figures.style import (
    BLACK,
    BLUE,
    CONCEPT_COLORS,
    CONCEPT_MARKERS,
    GRAY,
    SKY_BLUE,
    TEXT_WIDTH_IN,
    write_title,
)
from gpca.reporting.words import in_words, plural

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

ROW_IN = 0.33  # In less, the markers of one policy overlap.
APART = 0.26  # of a row
SHADES = (SKY_BLUE, BLUE, BLACK)  # The shade grows darker with every action.
ORDERS = {DOUBTED: ("in doubt first, as a queue gives them", BLUE, "-"), DRAWN: ("drawn at random", GRAY, "--")}
WORDS = {
    "reinitialize": "Reinitialize ICP\nbroader search over orientations",
    "new_view": "Change the viewpoint\nmore of the surface in sight",
    "denoise": "Filter, check the sensor\nseveral frames, outliers removed",
}
CONDITIONS = {
    "noise": "noise dominates",
    "pose": "pose dominates",
    "overlap": "overlap dominates",
}


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
    rates_or_none = {row: pool_share(metrics, name, metric, concept) for row, name in enumerate(shown)}
    rates = {row: rate for row, rate in rates_or_none.items() if rate is not None}
    for row, (share, trials) in rates.items():
        low, high = wilson_interval(share * trials, trials)
        axes.plot([100 * low, 100 * high], [row + offset] * 2, color=look["color"], linewidth=0.8)
    shares = [100 * share for share, _ in rates.values()]
    axes.plot(shares, [row + offset for row in rates], linestyle="", markersize=3.5, **look)


def draw_queued_labels(queues: pd.DataFrame, title: str, policies: Mapping[str, str]) -> Figure:
    """Draw a panel for each policy that learns: the error over labels by order, with its interval.

    Args:
        queues: What :func:`gpca.experiments.recovery.metrics.read_queues` returns.
    """
    shown = [name for name in policies if (queues["policy"] == name).any()]
    highest = 100 * queues[queues["policy"].isin(shown)]["high"].max()
    figure, [drawn] = panels(1, len(shown), 2.4, sharex=True, sharey=True)
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
    legend_below(figure, *drawn[0].get_legend_handles_labels())
    write_title(figure, f"{title}: judged on {int(queues['failures'].max())} failures")
    return figure


def draw_mitigation(title: str, policy_json: str | Path) -> Figure:
    """Draw the mapping of one policy: its inputs, its branches in the order of the tests, and the ways back.

    An action leads to new scores; a queued case leads to a label and to a classifier that has learned it.
    """
    policy = json.loads(Path(policy_json).read_text(encoding="utf-8"))
    limits, treatments = policy["thresholds"], policy["treatments"]
    canvas = Canvas(TEXT_WIDTH_IN, 2.62)
    write_title(canvas.figure, f"{title}: thresholds of this run")
    words = "GP-CA\n" + r"scores $\hat{s}_c$, variances $v_c$," + "\nBALD"
    canvas.box(0.04, 0.86, 1.3, 0.66, words)
    branches = [(_queue_condition(limits), "Abstain\nqueue for a person", GRAY)]
    branches += [
        (CONDITIONS.get(concept, concept), WORDS.get(action, in_words(action)), CONCEPT_COLORS[concept])
        for concept, action in sorted(treatments.items(), key=lambda item: ("pose", "overlap", "noise").index(item[0]))
    ]
    middles_in = [1.99 - 0.53 * place for place in range(len(branches))]
    for middle_in, (condition, branch, color) in zip(middles_in, branches, strict=True):
        canvas.box(1.95, middle_in - 0.2, 1.6, 0.4, condition, color, dashed=True)
        canvas.box(3.95, middle_in - 0.2, 1.85, 0.4, branch, color)
        canvas.arrow((1.34, 1.19), (1.62, 1.19), (1.62, middle_in), (1.95, middle_in))
        canvas.arrow((3.55, middle_in), (3.95, middle_in), color=color)
        canvas.arrow((5.8, middle_in), (6.05, middle_in))
    canvas.box(6.05, middles_in[0] - 0.2, 1.06, 0.4, "A person labels it\nthe GPC learns it")
    over_in = middles_in[0] + 0.32
    canvas.arrow((6.58, middles_in[0] + 0.2), (6.58, over_in), (0.69, over_in), (0.69, 1.52))
    canvas.text(3.6, over_in + 0.03, "the classifier that has learned the label decides all later cases", va="bottom")
    attempts = f"{limits['attempts']:.0f}"
    back = (
        "Register and\nscore anew\n\n"
        r"$\hat{s}_c$ falls by less" + f"\nthan {limits['improvement']:.2f}: next\nconcept; after\n"
        f"{plural(attempts, 'such attempt')}:\nqueue"
    )
    canvas.box(6.05, middles_in[-1] - 0.2, 1.06, middles_in[1] - middles_in[-1] + 0.4, back)
    canvas.arrow((6.58, middles_in[-1] - 0.2), (6.58, 0.06), (0.69, 0.06), (0.69, 0.86))
    return canvas.figure


def short_action(action: str) -> str:
    """Return the words for an action of recovery, its purpose left out."""
    return WORDS.get(action, in_words(action)).splitlines()[0].rstrip(",")


def _queue_condition(limits: Mapping[str, float]) -> str:
    return (
        f"BALD > {limits['uncertain']:.3f} nats\nor " + rf"$\mathrm{{max}}_c\,\hat{{s}}_c$ < {limits['dominant']:.2f}"
    )
