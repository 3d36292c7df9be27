"""Draws how useful the uncertainty of learners is: risk over coverage, reliability, uncertainty over distance.

All take the same arguments and raise the same error:

    learned: The predictions that :func:`gpca.experiments.out_of_distribution.metrics.read_learner_predictions` returns.
    sources, learners: The title of each name, in order; those without predictions are left out.
    InputError: There are no predictions of these sources and learners.

The learners of the paper have a color, as everywhere, and all others are gray: the tables tell them apart.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.diagnostics import BINS, rank_correlation, risk_coverage
from gpca.errors import InputError
from gpca.experiments.diagnosis.reliability import reliability_figure
from gpca.experiments.out_of_distribution.metrics import sets_of, with_training_like, wrong
from gpca.experiments.out_of_distribution.sets import DISTANCES
from gpca.reporting.figures.panels import legend_below, panels
from gpca.reporting.figures.style import METHOD_LOOKS, OTHER_LOOK, SMALL_PT, write_title

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SETS = {  # those whose ρ Table V has, alone and under shift
    "in_distribution": "like the training",
    with_training_like("severity"): "+ stronger severities",
    with_training_like("source"): "+ another source",
    with_training_like("objects"): "+ unseen objects",
}
Titles = Mapping[str, str]
COVERAGES = np.linspace(0.1, 1, 91)  # Of fewer samples, a single error would decide the share of errors.
DISTANCE_BINS = 10  # of equally many samples


def draw_coverage_risk(learned: Mapping, sources: Titles, learners: Titles) -> Figure:
    """Draw the mean over the seeds of the risk, by the largest score, on the test samples like the training's.

    A panel in which no classifier errs says so.
    """
    shown, columns = _known(learned, sources, learners)
    figure, axes = panels(1, len(columns), 2.5, sharex=True, sharey=True)
    for panel, source in zip(axes[0], columns, strict=True):
        for learner in _in_front(shown):
            risks = []
            for rows in _of(learned, source, learner, "in_distribution"):
                coverage, risk = risk_coverage(-rows["max_score"].to_numpy(), wrong(rows))
                risks.append(np.interp(COVERAGES, coverage, risk))
            if risks:
                panel.plot(100 * COVERAGES, 100 * np.mean(risks, axis=0), **_look(learner))
        panel.set_title(sources[source])
        panel.set_xlabel("coverage (%)")
        panel.set_xlim(0, 100)
        lines = panel.get_lines()
        if lines and not any(line.get_ydata().any() for line in lines):
            panel.text(0.5, 0.5, "no errors", transform=panel.transAxes, ha="center", va="center")
    axes[0, 0].set_ylim(bottom=0)
    axes[0, 0].set_ylabel("risk: errors among the covered (%)")
    _write_legend(figure, shown, learners)
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

    Above a panel stands ρ of the paper's learners by the letters of the legend, as Table V has it: the mean over the
    seeds of the rank correlation over all samples.
    """
    shown, columns = _known(learned, sources, learners)
    parts = {key: sets_of(rows) for key, rows in learned.items() if key[0] in columns and key[1] in shown}
    letters = dict(zip(_paper_first(shown), "abcdefgh", strict=False))
    down = [name for name in SETS if any(name in of_key for of_key in parts.values())]
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    figure, axes = panels(len(down), len(columns), 0.72 + 1.22 * len(down), sharex=True, sharey=True)
    for row, name in enumerate(down):
        for panel, source in zip(axes[row], columns, strict=True):
            correlations = {}
            for learner in _in_front(shown):
                of_set = [p[name] for key, p in parts.items() if key[:2] == (source, learner) and name in p]
                if of_set:
                    panel.plot(*distance_curve(of_set), **_look(learner))
                    rho_R = [rank_correlation(rows["max_score"], rows[DISTANCES[0]]) for rows in of_set]
                    correlations[learner] = float(np.mean(rho_R))
            _write_correlations(panel, {letters[key]: correlations[key] for key in _paper_first(correlations)})
            if row == 0:
                panel.text(0.5, 1.2, sources[source], transform=panel.transAxes, ha="center", va="bottom")
        axes[row, 0].set_ylabel(f"{SETS[name]}\n1 - largest score", fontsize=SMALL_PT)
    for panel in axes[-1]:
        panel.set_xlabel("distance to the training samples")
        panel.set_xscale("log")
        panel.xaxis.set_major_locator(LogLocator(base=2))
        panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        panel.xaxis.set_minor_locator(NullLocator())
    axes[0, 0].set_ylim(bottom=0)
    lettered = {name: f"{letters[name]}: {learners[name]}" for name in letters}
    _write_legend(figure, shown, lettered)
    write_title(figure, "Above each panel: rank correlation ρ of the learners that have a letter")
    return figure


def distance_curve(of_seeds: Sequence) -> tuple[np.ndarray, np.ndarray]:
    """Return median distance and mean of 1 - largest score of `DISTANCE_BINS` bins of equally many samples."""
    distance_S, score_S = (
        np.concatenate([rows[name].to_numpy(float) for rows in of_seeds]) for name in (DISTANCES[0], "max_score")
    )
    bins = np.array_split(np.argsort(distance_S, kind="stable"), min(DISTANCE_BINS, len(distance_S)))
    return np.array([np.median(distance_S[part]) for part in bins]), np.array([score_S[part].mean() for part in bins])


def _write_correlations(panel, correlations: Mapping[str, float]) -> None:
    panel.text(0.02, 1.03, "ρ", transform=panel.transAxes, ha="left", va="bottom", fontsize=SMALL_PT)
    for place, (letter, rho) in enumerate(correlations.items()):
        where = 0.1 + 0.9 * place / len(correlations), 1.03
        panel.text(*where, f"{letter} {rho:.3f}", transform=panel.transAxes, fontsize=SMALL_PT, va="bottom")


def _look(learner: str) -> dict:
    color, line, width = METHOD_LOOKS.get(learner, OTHER_LOOK)
    return {"color": color, "linestyle": line, "linewidth": width}


def _paper_first(learners: Iterable[str]) -> list[str]:
    """Return those that have a look of their own, in the order of the looks."""
    return [name for name in METHOD_LOOKS if name in set(learners)]


def _in_front(shown: list[str]) -> list[str]:
    """Return the learners in the order of drawing: the gray ones first, the paper's over them."""
    return [name for name in shown if name not in METHOD_LOOKS] + _paper_first(shown)[::-1]


def _write_legend(figure, shown: list[str], learners: Titles) -> None:
    """Name the lines of the paper's learners, and all others together."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], label=learners[name], **_look(name)) for name in _paper_first(shown)]
    if others := sum(name not in METHOD_LOOKS for name in shown):
        handles.append(Line2D([], [], label=f"{others} others", **_look("")))
    legend_below(figure, handles)


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
