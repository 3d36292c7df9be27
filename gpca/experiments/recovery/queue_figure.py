"""Draws learning from queued cases: failures that the first action leaves, over the labels that a person gave."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from gpca.experiments.recovery.queue_file import DOUBTED, DRAWN
from gpca.reporting.figures.panels import legend_below, panels
from gpca.reporting.figures.style import BLUE, GRAY, write_title

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

ORDERS = {DOUBTED: ("in doubt first, as a queue gives them", BLUE, "-"), DRAWN: ("drawn at random", GRAY, "--")}


def draw_queued_labels(queues: pd.DataFrame, title: str, policies: Mapping[str, str]) -> Figure:
    """Draw a panel for each policy that learns: the error over labels by order, with its interval.

    Args:
        queues: What :func:`gpca.experiments.recovery.queue_file.read_queues` returns.
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
