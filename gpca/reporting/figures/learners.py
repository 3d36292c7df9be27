"""Draws what the uncertainty of learners is worth: risk over coverage, reliability, uncertainty over distance.

All take the same arguments and raise the same error:

    learned: The predictions that :func:`gpca.shift.metrics.read_learner_predictions` returns.
    sources, learners: The title of each name, in order; those without predictions are left out.
    pdf_path, png_path: The two files to write.
    InputError: There are no predictions of these sources and learners.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gpca.attribution.diagnostics import BINS, rank_correlation, risk_coverage
from gpca.errors import InputError
from gpca.reporting.figures.panels import finish_panels, small_panels
from gpca.reporting.figures.reliability import draw_reliability_panel
from gpca.reporting.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY_BLUE,
    SMALL_PT,
    TEXT_WIDTH_IN,
    VERMILION,
    save_figure,
    use_style,
)
from gpca.shift.metrics import sets_of, wrong
from gpca.shift.sets import DISTANCES

STYLES = {  # A learner has a colour, a line and a width; the GPC is thick, and the paper's rivals are thinner.
    "gpca_paper": (BLUE, (0, (4, 2)), 1.8),
    "gpca": (BLUE, "-", 1.8),
    "learner_forest": (VERMILION, "-", 1.2),
    "learner_linear_svm": (ORANGE, "-", 1.2),
    "learner_rbf_svm": (ORANGE, ":", 0.9),
    "learner_logistic": (BLACK, "-", 0.9),
    "learner_nearest": (BLACK, ":", 0.9),
    "learner_ensemble": (GREEN, "-", 0.9),
    "learner_dropout": (GREEN, "--", 0.9),
    "learner_laplace_head": (GREEN, ":", 0.9),
    "learner_laplace_gpc": (SKY_BLUE, "-", 0.9),
    "learner_dirichlet_gp": (PURPLE, "-", 0.9),
}
_OTHER = (GREY, "-", 0.9)
SET_STYLES = {  # A set has a title and a colour.
    "in_distribution": ("like the training", GREY),
    "severity": ("severities beyond", ORANGE),
    "source": ("unseen source", BLUE),
    "objects": ("unseen objects", GREEN),
}
Titles = Mapping[str, str]
COVERAGES = np.linspace(0.02, 1, 99)


def draw_coverage_risk(
    learned: Mapping, sources: Titles, learners: Titles, pdf_path: str | Path, png_path: str | Path
) -> None:
    """Draw the mean over the seeds of the risk, by the largest score, on the test samples like the training's."""
    shown, columns = _known(learned, sources, learners)
    use_style()
    import matplotlib.pyplot as plt

    height_in = 2.75
    figure, axes = plt.subplots(
        1, len(columns), figsize=(TEXT_WIDTH_IN, height_in), sharex=True, sharey=True, squeeze=False
    )
    for panel, source in zip(axes[0], columns, strict=True):
        for learner in reversed(shown):
            risks = []
            for rows in _of(learned, source, learner, "in_distribution"):
                coverage, risk = risk_coverage(-rows["max_score"].to_numpy(), wrong(rows))
                risks.append(np.interp(COVERAGES, coverage, risk))
            if risks:
                colour, line, width = STYLES.get(learner, _OTHER)
                style = {"color": colour, "linestyle": line, "linewidth": width, "label": learners[learner]}
                panel.plot(100 * COVERAGES, 100 * np.mean(risks, axis=0), **style)
        panel.set_title(sources[source])
        panel.set_xlabel("coverage (%)")
        panel.set_xlim(0, 100)
    axes[0, 0].set_ylim(bottom=0)
    axes[0, 0].set_ylabel("risk: errors among the covered (%)")
    handles = {line.get_label(): line for panel in axes[0] for line in panel.get_lines()}
    titles = [learners[name] for name in shown]
    figure.legend([handles[title] for title in titles], titles, ncol=4, loc="lower center", columnspacing=1.2)
    figure.tight_layout(rect=(0, 0.62 / height_in, 1, 1), pad=0.4)
    save_figure(figure, pdf_path, png_path)


def draw_reliability(
    learned: Mapping, sources: Titles, learners: Titles, pdf_path: str | Path, png_path: str | Path
) -> None:
    """Draw accuracy over confidence, in the bins of the calibration error, and the share of samples in each bin.

    The samples are those like the training's, of all sources and seeds together. Bins of very few samples have no
    point. The number in a title is the calibration error of them all.
    """
    shown, columns = _known(learned, sources, learners)
    figure, panels = small_panels(len(shown), panel_height_in=1.55)
    for panel, learner in zip(panels, shown, strict=False):
        parts = [rows for source in columns for rows in _of(learned, source, learner, "in_distribution")]
        confidence_S = np.concatenate([1 - rows["max_score"].to_numpy() for rows in parts])
        hit_S = np.concatenate([~wrong(rows) for rows in parts])
        gap = draw_reliability_panel(panel, confidence_S, hit_S, BINS)
        panel.set_title(f"{learners[learner]}\nECE {gap:.3f}", fontsize=SMALL_PT)
        panel.set_xlim(1 / 3 - 0.03, 1.02)
        panel.set_xticks([0.4, 0.6, 0.8, 1.0])
    handles, labels = panels[0].get_legend_handles_labels()
    title = ", ".join(sources[name] for name in columns)
    finish_panels(figure, title, handles, labels, "largest score", "accuracy", pdf_path, png_path)


def draw_uncertainty_vs_distance(
    learned: Mapping, sources: Titles, learners: Titles, pdf_path: str | Path, png_path: str | Path
) -> None:
    """Draw 1 - largest score over the distance to the training samples, for the first seed of every source.

    ρ is the mean over sources, seeds and the three kinds of shift, each with the samples like the training's.
    """
    from matplotlib.lines import Line2D
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    shown, columns = _known(learned, sources, learners)
    figure, panels = small_panels(len(shown), panel_height_in=1.4)
    distance = DISTANCES[0]
    first_seed = min(seed for _, _, seed in learned)
    for panel, learner in zip(panels, shown, strict=False):
        correlations = []
        for (source, name, seed), rows in learned.items():
            if name != learner or source not in columns:
                continue
            parts = sets_of(rows)
            correlations += [rank_correlation(p["max_score"], p[distance]) for key, p in parts.items() if "+" in key]
            if seed == first_seed:
                for key, (_, colour) in SET_STYLES.items():
                    if key in parts:
                        points = {"color": colour, "alpha": 0.45, "s": 2.2, "linewidths": 0, "rasterized": True}
                        panel.scatter(parts[key][distance], parts[key]["max_score"], **points)
        panel.text(
            0.97, 0.92, f"ρ = {np.mean(correlations):.2f}", transform=panel.transAxes, ha="right", fontsize=SMALL_PT
        )
        panel.set_title(learners[learner], fontsize=SMALL_PT)
        panel.set_xscale("log")
        panel.xaxis.set_major_locator(LogLocator(base=2))
        panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        panel.xaxis.set_minor_locator(NullLocator())
        panel.set_ylim(-0.02, 0.82)
    handles = [Line2D([], [], color=c, marker="o", linestyle="") for _, c in SET_STYLES.values()]
    labels = [title for title, _ in SET_STYLES.values()]
    title = ", ".join(sources[name] for name in columns)
    finish_panels(figure, title, handles, labels, "distance", "1 - largest score", pdf_path, png_path)


def _known(learned: Mapping, sources: Titles, learners: Titles) -> tuple[list[str], list[str]]:
    shown = [name for name in learners if any(learner == name for _, learner, _ in learned)]
    columns = [name for name in sources if any(source == name for source, _, _ in learned)]
    if not shown or not columns:
        raise InputError("learners", "hold no predictions of these sources and learners", "run them first")
    return shown, columns


def _of(learned: Mapping, source: str, learner: str, of_set: str) -> list:
    """Return the rows of a set, seed by seed."""
    found = [rows[rows["set"] == of_set] for key, rows in learned.items() if key[:2] == (source, learner)]
    return [rows for rows in found if len(rows)]
