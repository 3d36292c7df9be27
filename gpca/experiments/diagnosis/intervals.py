"""Intervals of the measures over objects and seeds, and of the differences between explainers on the same samples."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.confidence import bounds, pigeonhole_weights
from gpca.experiments.diagnosis.judged import CEILING, Judged, joined, read_judged
from gpca.experiments.diagnosis.measures import MEASURES, SMALLER_IS_BETTER, counted, measure
from gpca.experiments.diagnosis.metrics import with_pooled
from gpca.io.csv_file import read_numbers
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = (
    *("source", "method", "metric", "samples", "seeds", "value", "low", "high"),
    *("rival", "difference", "difference_low", "difference_high"),
)


def collect(prediction_files: Iterable[str | Path], causes_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return for every source, explainer and measure the value over all seeds and its 95 % interval.

    The rival is the best other explainer by that measure; the difference from it is that of the same draws. The
    ceiling is no rival.
    """
    import pandas as pd

    judged = with_pooled(read_judged(prediction_files, causes_files))
    rows: list[tuple] = []
    for source in dict.fromkeys(source for source, _, _ in judged):
        of_source: dict[str, list[Judged]] = {}
        for (own, explainer, _), samples in judged.items():
            if own == source:
                of_source.setdefault(explainer, []).append(samples)
        rows += _of_source(source, {explainer: joined(parts) for explainer, parts in of_source.items()})
    return pd.DataFrame(rows, columns=list(COLUMNS))


def read_intervals(path: str | Path) -> pd.DataFrame:
    """Read what :func:`collect` returned; where there is no rival, the difference is NaN.

    Raises:
        InputError: missing, empty or unreadable file, missing column, a value that is no finite number.
    """
    return read_numbers(path, COLUMNS, (*COLUMNS[3:8], *COLUMNS[9:]), optional=(*COLUMNS[6:8], *COLUMNS[9:]))


def _of_source(source: str, samples_of: dict[str, Judged]) -> list[tuple]:
    any_samples = next(iter(samples_of.values()))
    drawn_B_N = pigeonhole_weights(generator("cause intervals", source), any_samples.seed, any_samples.instance)
    return rows_of(source, samples_of, drawn_B_N, measure, MEASURES)


def rows_of(
    source: str,
    samples_of: dict[str, Judged],
    drawn_B_N: np.ndarray,
    measured: Callable[[Judged, np.ndarray], dict[str, np.ndarray]],
    metrics: Iterable[str],
) -> list[tuple]:
    """Return rows of `COLUMNS`, of those metrics that have a value; `samples` are those that the metric counts.

    Args:
        samples_of: explainer -> the same N samples beside what it said of them.
        drawn_B_N: how often each draw of a bootstrap has each of them.
        measured: returns the metrics of samples, for weights of these.
    """
    any_samples = next(iter(samples_of.values()))
    weights_B_N = np.vstack([np.ones(len(any_samples)), drawn_B_N])
    values = {
        explainer: {metric: found for metric, found in measured(samples, weights_B_N).items() if np.isfinite(found[0])}
        for explainer, samples in samples_of.items()
    }
    seeds = len(set(any_samples.seed.tolist()))
    rows = []
    for metric in metrics:
        ranked = sorted(
            (explainer for explainer in values if explainer != CEILING and metric in values[explainer]),
            key=lambda explainer: values[explainer][metric][0] * (1 if metric in SMALLER_IS_BETTER else -1),
        )
        for explainer, found in values.items():
            if metric not in found:
                continue
            rival = next((name for name in ranked if name != explainer), "") if explainer != CEILING else ""
            apart = found[metric] - values[rival][metric] if rival else np.full(len(weights_B_N), np.nan)
            of_value, of_difference = bounds(found[metric][1:]), bounds(apart[1:])
            own = (source, explainer, metric, counted(any_samples, metric), seeds)
            rows.append((*own, found[metric][0], *of_value, rival, apart[0], *of_difference))
    return rows
