"""Draws what queued cases teach: failures that the first action leaves, over the labels that a person gave."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.experiments.recovery.queue_file import DOUBTED, DRAWN
from gpca.reporting.figures.style import BLUE, GREY, TEXT_WIDTH_IN, save_figure, use_style, write_title

if TYPE_CHECKING:
    import pandas as pd

ORDERS = {DOUBTED: ("in doubt first, as a queue gives them", BLUE, "-"), DRAWN: ("drawn at random", GREY, "--")}


def draw_queued_labels(
    queues: pd.DataFrame, title: str, policies: Mapping[str, str], pdf_path: str | Path, png_path: str | Path
) -> None:
    """Draw a panel for each policy that learns: the error over labels by order, with its interval.

    Args:
        queues: What :func:`gpca.experiments.recovery.queue_file.read_queues` returns.
        title: Where the failures are from.
        policies: The title of each name, in order.
        pdf_path, png_path: The two files to write.
    """
    plt = use_style()
    shown = [name for name in policies if (queues["policy"] == name).any()]
    size = (TEXT_WIDTH_IN, 2.4)
    highest = 100 * queues[queues["policy"].isin(shown)]["high"].max()
    figure, panels = plt.subplots(1, len(shown), figsize=size, sharex=True, sharey=True, squeeze=False)
    for panel, policy in zip(panels[0], shown, strict=True):
        for order, (words, colour, line) in ORDERS.items():
            curve = queues[(queues["policy"] == policy) & (queues["order"] == order)].sort_values("labels")
            panel.plot(curve["labels"], 100 * curve["error"], line, color=colour, label=words, linewidth=1.4)
            bounds = (100 * curve[name] for name in ("low", "high"))
            panel.fill_between(curve["labels"], *bounds, color=colour, alpha=0.15, linewidth=0)
        panel.set_title(policies[policy])
        panel.set_xlabel("queued cases labeled, per seed")
        panel.set_ylim(0, min(100, 1.05 * highest))
        panel.margins(x=0.01)
        panel.xaxis.get_major_locator().set_params(integer=True)
    panels[0, 0].set_ylabel("not solved by the first action (%)")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="lower center", ncol=len(ORDERS))
    failures = int(queues["failures"].max())
    write_title(figure, f"{title}: judged on {failures} failures")
    figure.tight_layout(rect=(0, 0.2 / size[1], 1, 1 - 0.17 / size[1]), pad=0.4, w_pad=1.2)
    save_figure(figure, pdf_path, png_path)
