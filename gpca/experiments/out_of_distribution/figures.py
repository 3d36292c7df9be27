"""Draws how useful the uncertainty of learners is: risk over coverage, reliability, uncertainty over distance.

All take the same arguments and raise the same error:

    learned: The predictions that :func:`gpca.experiments.out_of_distribution.metrics.read_learner_predictions` returns.
    sources, learners: The title of each name, in order; those without predictions are left out.
    InputError: There are no predictions of these sources and learners.

The learners of the paper have a color, as everywhere; the others take theirs in turn.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.attribution.diagnostics import BINS, risk_coverage
from gpca.errors import InputError
from gpca.experiments.diagnosis.reliability import reliability_figure
from gpca.experiments.out_of_distribution.metrics import sets_of, with_training_like, wrong
from gpca.experiments.out_of_distribution.sets import DISTANCES
from gpca.reporting.figures.panels import legend_below, panels
from gpca.reporting.figures.style import (
    BLACK,
    GRAY,
    GREEN,
    METHOD_LOOKS,
    ORANGE,
    OTHER_LOOK,
    PURPLE,
    SMALL_PT,
    VERMILION,
    write_title,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SETS = {  # those whose ρ Table V has, alone and under shift
    "in_distribution": "like the training",
    with_training_like("severity"): "+ stronger severities",
    with_training_like("source"): "+ another source",
    with_training_like("objects"): "+ unseen objects",
}
Titles = Mapping[str, str]
COVERAGES = np.linspace(0, 1, 101)
ENOUGH = 0.1  # Of a smaller share of the samples a single error decides the risk, so that the axis follows the others.
DISTANCE_BINS = 10  # of equally many samples
BESIDE_OTHERS = "gpca"  # stands in the panels of the learners that the paper does not have
OTHER_LOOKS: tuple[tuple[str, Any, float], ...] = (
    *((color, "-", 1.1) for color in (BLACK, GREEN, PURPLE, GRAY)),
    *((color, (0, (4, 2)), 1.1) for color in (BLACK, GREEN, PURPLE, GRAY)),
    *((color, (0, (1, 1)), 1.1) for color in (BLACK, GREEN, VERMILION, ORANGE)),
)


def draw_coverage_risk(learned: Mapping, sources: Titles, learners: Titles) -> Figure:
    """Draw the mean over the seeds of the risk, by the largest score, on the test samples like the training's.

    The paper's learners are above, and below are the others beside GP-CA. A panel in which no classifier errs says so.
    """
    shown, columns = _known(learned, sources, learners)
    lines, looks = _lines(shown), _looks(shown)
    figure, axes = panels(len(lines), len(columns), 1.0 + 1.6 * len(lines), sharex=True, sharey=True)
    highest = 0.0
    for line, of_line in zip(axes, lines, strict=True):
        for panel, source in zip(line, columns, strict=True):
            for learner in reversed(of_line):
                risks = []
                for rows in _of(learned, source, learner, "in_distribution"):
                    coverage, risk = risk_coverage(-rows["max_score"].to_numpy(), wrong(rows))
                    risks.append(np.interp(COVERAGES, coverage, risk))
                if risks:
                    mean = 100 * np.mean(risks, axis=0)
                    panel.plot(100 * COVERAGES, mean, **looks[learner])
                    highest = max(highest, float(mean[COVERAGES >= ENOUGH].max()))
            drawn = panel.get_lines()
            if drawn and not any(curve.get_ydata().any() for curve in drawn):
                panel.text(0.5, 0.5, "no errors", transform=panel.transAxes, ha="center", va="center")
        line[0].set_ylabel("errors among\nthe covered (%)")
    for panel, source in zip(axes[0], columns, strict=True):
        panel.set_title(sources[source])
    for panel in axes[-1]:
        panel.set_xlabel("coverage (%)")
    axes[0, 0].set(xlim=(0, 100), ylim=(0, 1.05 * highest or 1))
    _write_legend(figure, shown, learners, looks)
    return figure


def draw_reliability(learned: Mapping, sources: Titles, learners: Titles) -> Figure:
    """Draw accuracy over confidence, in the bins of the calibration error, and the number of samples in each bin.

    The samples are those like the training's, of all sources and seeds together. Bins of very few samples have no
    point. The number in a title is the calibration error of them all.
    """
    shown, columns = _known(learned, sources, learners)
    samples = {}
    for learner in shown:
        parts = [rows for source in columns for rows in _of(learned, source, learner, "in_distribution")]
        confidence_S = np.concatenate([1 - rows["max_score"].to_numpy() for rows in parts])
        samples[learners[learner]] = confidence_S, np.concatenate([~wrong(rows) for rows in parts])
    return reliability_figure(samples, ", ".join(sources[name] for name in columns), BINS)


def draw_uncertainty_vs_distance(learned: Mapping, sources: Titles, learners: Titles) -> Figure:
    """Draw the mean of 1 - largest score over the distance to the training samples: sources as columns, sets as rows.

    The paper's learners are shown, or if there are none of them the others, with 95 % intervals. In each panel stands
    the number n of samples, those of all seeds together.
    """
    known, columns = _known(learned, sources, learners)
    shown = _paper_first(known) or known[: len(METHOD_LOOKS)]
    looks = _looks(known)
    parts = {key: sets_of(rows) for key, rows in learned.items() if key[0] in columns and key[1] in shown}
    down = [name for name in SETS if any(name in of_key for of_key in parts.values())]
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    figure, axes = panels(len(down), len(columns), 0.9 + 1.2 * len(down), sharex=True, sharey=True)
    for row, name in enumerate(down):
        for panel, source in zip(axes[row], columns, strict=True):
            samples = 0
            for learner in reversed(shown):
                of_set = [p[name] for key, p in parts.items() if key[:2] == (source, learner) and name in p]
                if of_set:
                    distance, mean, half = distance_curve(of_set)
                    panel.plot(distance, mean, **looks[learner])
                    band = {"color": looks[learner]["color"], "alpha": 0.15, "linewidth": 0}
                    panel.fill_between(distance, np.maximum(mean - half, 0), mean + half, **band)
                    samples = sum(map(len, of_set))
            panel.text(0.03, 0.96, f"$n$ = {samples}", transform=panel.transAxes, va="top", fontsize=SMALL_PT)
        axes[row, 0].set_ylabel(f"{SETS[name]}\n1 - largest score", fontsize=SMALL_PT)
    for panel, source in zip(axes[0], columns, strict=True):
        panel.set_title(sources[source])
    for panel in axes[-1]:
        panel.set_xlabel("distance to the training samples")
        panel.set_xscale("log")
        panel.xaxis.set_major_locator(LogLocator(base=2))
        panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        panel.xaxis.set_minor_locator(NullLocator())
    axes[0, 0].set_ylim(bottom=0)
    _write_legend(figure, shown, learners, looks)
    write_title(figure, "Means in bins of equally many of the n samples, and their 95 % intervals")
    return figure


def distance_curve(of_seeds: Sequence) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return median distance and mean of 1 - largest score of `DISTANCE_BINS` bins of equally many samples.

    The third array is half the width of the means' 95 % intervals, by the normal distribution of independent samples.
    """
    distance_S, score_S = (
        np.concatenate([rows[name].to_numpy(float) for rows in of_seeds]) for name in (DISTANCES[0], "max_score")
    )
    bins = np.array_split(np.argsort(distance_S, kind="stable"), min(DISTANCE_BINS, len(distance_S)))
    halves = [1.96 * score_S[part].std() / np.sqrt(max(len(part) - 1, 1)) for part in bins]
    medians, means = [np.median(distance_S[part]) for part in bins], [score_S[part].mean() for part in bins]
    return np.array(medians), np.array(means), np.array(halves)


def _looks(shown: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Return color, line and width of every learner; those without a look of their own take `OTHER_LOOKS` in turn."""
    others = iter(OTHER_LOOKS)
    own = {name: METHOD_LOOKS[name] if name in METHOD_LOOKS else next(others, OTHER_LOOK) for name in shown}
    return {name: {"color": look[0], "linestyle": look[1], "linewidth": look[2]} for name, look in own.items()}


def _paper_first(learners: Iterable[str]) -> list[str]:
    """Return those that have a look of their own, in the order of the looks."""
    return [name for name in METHOD_LOOKS if name in set(learners)]


def _lines(shown: Sequence[str]) -> list[list[str]]:
    """Return the learners of each line of panels: the paper's, then the others beside GP-CA."""
    paper, others = _paper_first(shown), [name for name in shown if name not in METHOD_LOOKS]
    beside = [name for name in paper if name == BESIDE_OTHERS]
    return [names for names in (paper, [*beside, *others] if others else []) if names]


def _write_legend(figure, shown: Sequence[str], learners: Titles, looks: Mapping[str, dict[str, Any]]) -> None:
    """Name the line of every learner, the paper's first."""
    from matplotlib.lines import Line2D

    ordered = [*_paper_first(shown), *(name for name in shown if name not in METHOD_LOOKS)]
    legend_below(figure, [Line2D([], [], label=learners[name], **looks[name]) for name in ordered])


def _known(learned: Mapping, sources: Titles, learners: Titles) -> tuple[list[str], list[str]]:
    shown = [name for name in learners if any(learner == name for _, learner, _ in learned)]
    columns = [name for name in sources if any(source == name for source, _, _ in learned)]
    if not shown or not columns:
        raise InputError("learners", "have no predictions of these sources and learners", "run them first")
    return shown, columns


def _of(learned: Mapping, source: str, learner: str, of_set: str) -> list:
    """Return the rows of a set, seed by seed."""
    parts = [rows[rows["set"] == of_set] for key, rows in learned.items() if key[:2] == (source, learner)]
    return [rows for rows in parts if len(rows)]
