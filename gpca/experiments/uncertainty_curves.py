"""How useful the uncertainty of learners is: risk over coverage, reliability, uncertainty over distance (Table V)."""

from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from gpca.attribution.diagnostics import BINS
from gpca.attribution.learner_predictions import read_learner_predictions, sets_of, wrong
from gpca.declarations import Figure, Paths, Run, figure
from gpca.errors import InputError
from gpca.evaluation.intervals import mean_interval, wilson_interval
from gpca.experiments.out_of_distribution import SECTION, learner_titles
from gpca.pairs.shifted_sets import DISTANCES, with_training_like
from gpca.reporting.figures import style
from gpca.reporting.figures.panels import in_lines, legend_below, panels

SETS = {  # those of which Table V, alone or under shift, has ρ
    "in_distribution": "like the training",
    with_training_like("severity"): "+ stronger severities",
    with_training_like("source"): "+ another source",
    with_training_like("objects"): "+ unseen objects",
}
LIKE_TRAINING = next(iter(SETS))
COVERAGES = np.linspace(0, 1, 101)
ENOUGH = 0.1  # the axis ignores smaller shares of the samples, where a single error decides the risk
DISTANCE_BINS = 10  # of equally many samples
FEWEST = 5  # samples of a bin of confidence that has a point
PREDICTIONS, SET_FILES = "learners/{source}/{learner}/seed{seed}.csv", "shifted/{source}/seed{seed}.npz"


def read_with_distances(files: Paths) -> dict:
    sets = [path for path in files if Path(path).suffix == ".npz"]
    return read_learner_predictions([path for path in files if path not in sets], sets)


@figure(
    SECTION,
    "Risk over coverage",
    """Share of errors among the most confident samples, over the share that is kept. The curve falls towards the left
    if a classifier knows what it does not know; the axis may cut it below 10 %. Bands are 95 % intervals over the
    seeds. The area under it is the AURC of Table V (the paper's AUC), which has every classifier.""",
    learned=(read_learner_predictions, PREDICTIONS),
)
def coverage_risk(run: Run, learned: Mapping) -> Figure:
    shown, columns = _shown(run, learned)
    drawing, [axes] = _panels(1, columns, 2.6, "coverage (%)")
    highest = 0.0
    for panel, source in zip(axes, columns, strict=True):
        for learner in reversed(shown):
            risks = []
            for rows in _of(learned, source, learner, LIKE_TRAINING):
                wrong_S = wrong(rows)[rows["max_score"].to_numpy().argsort(kind="stable")]  # from the surest on
                kept_S = np.arange(1, len(rows) + 1)
                risks.append(100 * np.interp(COVERAGES, kept_S / len(rows), np.cumsum(wrong_S) / kept_S))
            if risks:
                mean, *bounds = np.array([mean_interval(risk_R) for risk_R in np.transpose(risks)]).T
                _draw_band(panel, learner, 100 * COVERAGES, mean, *np.clip(bounds, 0, 100))
                highest = max(highest, float(mean[COVERAGES >= ENOUGH].max()))
        drawn = panel.get_lines()
        if drawn and not any(curve.get_ydata().any() for curve in drawn):
            panel.text(0.5, 0.5, "no errors", transform=panel.transAxes, ha="center", va="center")
    axes[0].set(xlim=(0, 100), ylim=(0, 1.05 * highest or 1), ylabel="errors among\nthe covered (%)")
    _write_legend(drawing, shown)
    return drawing


@figure(
    SECTION,
    "Reliability",
    """Accuracy over confidence: above the diagonal a classifier is underconfident, below it overconfident. Vertical
    lines are Wilson's intervals (95 %) of independent samples. The number is the calibration error of the samples of
    all seeds together (pooled ECE); Table V has the mean of each seed's own.""",
    learned=(read_learner_predictions, PREDICTIONS),
)
def reliability(run: Run, learned: Mapping) -> Figure:
    import pandas as pd

    shown, columns = _shown(run, learned)
    drawing, axes = _panels(len(shown), columns, 0.7 + 1.3 * len(shown), "largest score")
    for row, learner in zip(axes, shown, strict=True):
        row[0].set_ylabel(f"{in_lines(shown[learner])}\naccuracy", fontsize=style.SMALL_PT)
        for panel, source in zip(row, columns, strict=True):
            panel.plot([0, 1], [0, 1], color=style.GRAY, linewidth=0.6, linestyle=(0, (4, 3)))
            if parts := _of(learned, source, learner, LIKE_TRAINING):
                rows = pd.concat(parts)
                gap = _draw_reliability(panel, 1 - rows["max_score"].to_numpy(), ~wrong(rows), _look(learner)["color"])
                words = f"ECE {gap:.3f}, $n$ = {len(rows)}"
                panel.text(0.03, 0.96, words, transform=panel.transAxes, va="top", fontsize=style.SMALL_PT)
    axes[0, 0].set(xlim=(0, 1.02), ylim=(0, 1.25), yticks=(0, 0.5, 1))
    return drawing


def _draw_reliability(panel, confidence_S: np.ndarray, right_S: np.ndarray, color: str) -> float:
    """Draw the accuracy of each bin of confidence with Wilson's interval; return the expected calibration error."""
    bin_S = np.minimum((confidence_S * BINS).astype(int), BINS - 1)
    parts = [bin_S == bin_ for bin_ in range(BINS) if (bin_S == bin_).sum() >= FEWEST]
    mean_B, right_B = [confidence_S[part].mean() for part in parts], [right_S[part].mean() for part in parts]
    low_B, high_B = zip(*(wilson_interval(right_S[part].sum(), part.sum()) for part in parts), strict=True)
    panel.vlines(mean_B, low_B, high_B, color=color, linewidth=0.7)
    panel.plot(mean_B, right_B, "o-", color=color, markersize=2.5, linewidth=1.0)
    return float(np.abs(np.bincount(bin_S, weights=confidence_S - right_S, minlength=BINS)).sum() / len(right_S))


@figure(
    SECTION,
    "Uncertainty over distance to the training samples",
    """Uncertainty over the distance to the training samples, the mean in ten bins of equally many: in distribution,
    and with the samples of each shift; ρ of Table V is the rank correlation of the two. Bands are 95 % intervals of
    independent samples, and n counts those of all seeds. The distance is the mean to the ten nearest training samples,
    in the paper's classic (analytical) features, each in units of its standard deviation over the training samples.""",
    learned=(read_with_distances, (PREDICTIONS, SET_FILES)),
)
def uncertainty_vs_distance(run: Run, learned: Mapping) -> Figure:
    from matplotlib.ticker import LogLocator, NullLocator

    shown, columns = _shown(run, learned)
    down = [name for name in SETS if any(_of(learned, *pair, name) for pair in product(columns, shown))]
    drawing, axes = _panels(len(down), columns, 0.9 + 1.2 * len(down), "distance to the training samples")
    for row, name in zip(axes, down, strict=True):
        for panel, source in zip(row, columns, strict=True):
            samples = 0
            for learner in reversed(shown):
                if seeds := _of(learned, source, learner, name):
                    distance, mean, half = distance_curve(seeds)
                    _draw_band(panel, learner, distance, mean, np.maximum(mean - half, 0), mean + half)
                    samples = sum(map(len, seeds))
            panel.text(0.03, 0.96, f"$n$ = {samples}", transform=panel.transAxes, va="top", fontsize=style.SMALL_PT)
        row[0].set_ylabel(f"{SETS[name]}\n1 - largest score", fontsize=style.SMALL_PT)
    for panel in axes[-1]:
        panel.set_xscale("log")
        panel.xaxis.set_major_locator(LogLocator(base=2))
        panel.xaxis.set_major_formatter("{x:g}")
        panel.xaxis.set_minor_locator(NullLocator())
    axes[0, 0].set_ylim(bottom=0)
    _write_legend(drawing, shown)
    style.write_title(drawing, "Means in bins of equally many of the n samples, and their 95 % intervals")
    return drawing


def _panels(rows: int, sources: Mapping[str, str], height_in: float, across: str) -> tuple[Figure, np.ndarray]:
    """Panels with a column for each source, and what they have across."""
    drawing, axes = panels(rows, len(sources), height_in, sharex=True, sharey=True)
    for column, title in enumerate(sources.values()):
        axes[0, column].set_title(title)
        axes[-1, column].set_xlabel(across)
    return drawing, axes


def distance_curve(seeds: Sequence) -> np.ndarray:
    """Median distance and mean of 1 - largest score (3, B) of `DISTANCE_BINS` bins of equally many samples.

    The third row is half the width of the means' 95 % intervals, by the normal distribution of independent samples.
    """
    distance_S, score_S = (
        np.concatenate([rows[name].to_numpy(float) for rows in seeds]) for name in (DISTANCES[0], "max_score")
    )
    bins = np.array_split(np.argsort(distance_S, kind="stable"), min(DISTANCE_BINS, len(distance_S)))
    half_B = [1.96 * score_S[part].std() / np.sqrt(max(len(part) - 1, 1)) for part in bins]
    return np.array([[np.median(distance_S[part]) for part in bins], [score_S[part].mean() for part in bins], half_B])


def _look(learner: str) -> dict[str, Any]:
    look = style.METHOD_LOOKS.get(learner, style.OTHER_LOOK)
    return dict(zip(("color", "linestyle", "linewidth"), look, strict=True))


def _draw_band(panel, learner: str, x: np.ndarray, y: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    panel.plot(x, y, **_look(learner))
    panel.fill_between(x, low, high, color=_look(learner)["color"], alpha=0.15, linewidth=0)


def _write_legend(drawing: Figure, shown: Mapping[str, str]) -> None:
    from matplotlib.lines import Line2D

    legend_below(drawing, [Line2D([], [], label=title, **_look(name)) for name, title in shown.items()])


def _shown(run: Run, learned: Mapping) -> tuple[dict[str, str], dict[str, str]]:
    """Titles of the classifiers that have a look of their own (else of all) and of the sources, with predictions."""
    present = [{key[place] for key in learned} for place in (0, 1)]
    sources = {name: title for name, title in run.source_titles.items() if name in present[0]}
    learners = {name: title for name, title in learner_titles(run.config).items() if name in present[1]}
    if not learners or not sources:
        raise InputError("learners", "have no predictions of these sources and learners", "run them first")
    return {name: learners[name] for name in style.METHOD_LOOKS if name in learners} or learners, sources


def _of(learned: Mapping, source: str, learner: str, name: str) -> list:
    """Rows of a set, alone or with those that it is compared with, of each seed that has any."""
    of_seeds = [sets_of(rows) for key, rows in learned.items() if key[:2] == (source, learner)]
    return [sets[name] for sets in of_seeds if name in sets]
