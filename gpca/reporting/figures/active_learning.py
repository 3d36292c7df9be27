"""Draws learning curves of active learning: accuracy over labels by strategy, sources and encoders as panels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.active_learning.curves import read_curves
from gpca.attribution.metrics import mean_interval, source_method_seed
from gpca.errors import InputError
from gpca.reporting.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY_BLUE,
    TEXT_WIDTH_IN,
    VERMILION,
    save_figure,
    use_style,
)

if TYPE_CHECKING:
    import pandas as pd

ROWS = {"pretrained": "encoder saw\nall concepts", "unseen": "encoder never saw\nthe new concept"}
STYLES = {  # The paper's two strategies are thick, with their intervals; an unknown one has the style _OTHER.
    "bald_kmeans": (BLUE, "-", 1.8),
    "random": (BLACK, "-", 1.8),
    "random_stratified": (BLACK, ":", 0.9),
    "bald": (BLUE, "--", 0.9),
    "bald_stochastic": (SKY_BLUE, "-", 0.9),
    "entropy": (VERMILION, "-", 0.9),
    "margin": (ORANGE, "-", 0.9),
    "badge": (GREEN, "-", 0.9),
    "coreset": (PURPLE, "-", 0.9),
    "typiclust": (PURPLE, "--", 0.9),
}
_OTHER = (GREY, "-", 0.9)


def draw_learning_curves(
    curve_files: Iterable[str | Path],
    sources: Mapping[str, str],
    strategies: Mapping[str, str],
    target: float,
    pdf_path: str | Path,
    png_path: str | Path,
) -> None:
    """Draw the accuracy over labels: its mean over the concepts held out, then over the seeds.

    Args:
        curve_files: Files named `…/{source}/{strategy}/seed{seed}.csv`, as :mod:`gpca.active_learning.curves` says.
        sources, strategies: The title of each name, in order; those without curves are left out.
        target: The accuracy that counts as reached, which a dashed line marks.
        pdf_path, png_path: The two files to write.

    Raises:
        InputError: an unusable file, or no curve of these.
    """
    curves = mean_curves(curve_files)
    columns = [name for name in sources if any(source == name for source, _, _ in curves)]
    rows = [name for name in ROWS if any(setting == name for _, _, setting in curves)]
    shown = [name for name in strategies if any(strategy == name for _, strategy, _ in curves)]
    if not (columns and rows and shown):
        raise InputError("active learning", "holds no curve of these sources and strategies", "run it first")
    use_style()
    import matplotlib.pyplot as plt

    height_in = 0.62 + 1.5 * len(rows)
    figure, axes = plt.subplots(
        len(rows), len(columns), figsize=(TEXT_WIDTH_IN, height_in), sharex=True, sharey=True, squeeze=False
    )
    for row, setting in enumerate(rows):
        for column, source in enumerate(columns):
            panel = axes[row, column]
            panel.axhline(100 * target, color=GREY, linewidth=0.6, linestyle=(0, (4, 3)))
            for strategy in reversed(shown):
                if (source, strategy, setting) in curves:
                    _draw(panel, strategy, strategies[strategy], curves[source, strategy, setting])
            panel.margins(x=0.01)
            if row == 0:
                panel.set_title(sources[source])
            if row == len(rows) - 1:
                panel.set_xlabel("labels")
        axes[row, 0].set_ylabel(f"accuracy (%)\n{ROWS[setting]}")
    handles = {line.get_label(): line for line in axes[0, 0].get_lines() if not line.get_label().startswith("_")}
    ordered = [strategies[name] for name in shown if strategies[name] in handles]
    figure.legend([handles[title] for title in ordered], ordered, ncol=5, loc="lower center", columnspacing=1.4)
    figure.tight_layout(rect=(0, 0.4 / height_in, 1, 1), pad=0.4, h_pad=0.8)
    save_figure(figure, pdf_path, png_path)


def mean_curves(curve_files: Iterable[str | Path]) -> dict[tuple[str, str, str], pd.DataFrame]:
    """Return labels, mean, low and high accuracy in % by source, strategy and setting; intervals are over the seeds."""
    import pandas as pd

    parts: dict[tuple[str, str, str], list] = {}
    for path in curve_files:
        source, strategy, seed = source_method_seed(path)
        for (setting, _), curve in read_curves(path).items():
            parts.setdefault((source, strategy, setting), []).append(curve[["labels", "accuracy"]].assign(seed=seed))
    means = {}
    for key, of_key in parts.items():
        of_seed = pd.concat(of_key).groupby(["labels", "seed"])["accuracy"].mean()
        rows = [(labels, *(100 * np.array(mean_interval(part)))) for labels, part in of_seed.groupby(level="labels")]
        means[key] = pd.DataFrame(rows, columns=["labels", "mean", "low", "high"])
    return means


def _draw(axes, strategy: str, title: str, curve: pd.DataFrame) -> None:
    colour, line, width = STYLES.get(strategy, _OTHER)
    axes.plot(curve["labels"], curve["mean"], line, color=colour, linewidth=width, label=title)
    if width > 1:
        axes.fill_between(
            curve["labels"],
            curve["low"].clip(0, 100),
            curve["high"].clip(0, 100),
            color=colour,
            alpha=0.15,
            linewidth=0,
        )
