"""Turns diagnoses into tidy metrics, and into intervals of these and of differences on the same samples."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.metrics import ABSTAINED, PREDICTED_AS, confusion
from gpca.causes.dataset import LABELS
from gpca.causes.judged import (
    CEILING,
    MEASURES,
    SHARES,
    SMALLER_IS_BETTER,
    Judged,
    counted,
    joined,
    measure,
    read_judged,
)
from gpca.causes.truth import BORDERLINE
from gpca.evaluation.intervals import Difference, from_rival, from_untrained, interval, pigeonhole_weights
from gpca.evaluation.measures import ALL, POOLED, tidy
from gpca.io.csv_file import read_numbers
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

TABLE = "causes"
COLUMNS = (
    *("source", "method", "metric", "samples", "seeds", "value", "low", "high"),
    *("rival", "difference", "difference_low", "difference_high"),
    *("untrained", "gain", "gain_low", "gain_high"),
)
NUMBERS = tuple(name for name in COLUMNS[3:] if name not in ("rival", "untrained"))


def collect(prediction_files: Iterable[str | Path], causes_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return tidy metrics of all test samples of a seed: the confusion, and what `measures` measures.

    Raises:
        InputError: see :func:`gpca.causes.judged.read_judged`.
    """
    records = []
    for (source, explainer, seed), samples in with_pooled(read_judged(prediction_files, causes_files)).items():
        one_1_N = np.ones((1, len(samples)))
        values = {metric: value_1[0] for metric, value_1 in measure(samples, one_1_N).items()}
        values["test_samples"] = len(samples)
        records += [
            (TABLE, source, explainer, metric, ALL, seed, float(value))
            for metric, value in values.items()
            if np.isfinite(value)
        ]
        records += [(TABLE, source, explainer, *row[:2], seed, row[2]) for row in _confusion(samples)]
    return tidy(records, "diagnoses")


def with_pooled(judged: dict[tuple[str, str, int], Judged]) -> dict[tuple[str, str, int], Judged]:
    """Return the same with all sources together besides, where there are several."""
    sources = list(dict.fromkeys(source for source, _, _ in judged))
    if len(sources) < 2:
        return judged
    rest = list(dict.fromkeys((explainer, seed) for _, explainer, seed in judged))
    return judged | {
        (POOLED, explainer, seed): joined(judged[source, explainer, seed] for source in sources)
        for explainer, seed in rest
        if all((source, explainer, seed) in judged for source in sources)
    }


def by_source(
    prediction_files: Iterable[str | Path], causes_files: Iterable[str | Path]
) -> dict[str, dict[str, Judged]]:
    """Return the samples of all seeds together, for every source and all of them, by explainer.

    Raises:
        InputError: see :func:`gpca.causes.judged.read_judged`.
    """
    parts: dict[str, dict[str, list[Judged]]] = {}
    for (source, explainer, _), samples in with_pooled(read_judged(prediction_files, causes_files)).items():
        parts.setdefault(source, {}).setdefault(explainer, []).append(samples)
    return {
        source: {explainer: joined(of_seeds) for explainer, of_seeds in of_source.items()}
        for source, of_source in parts.items()
    }


def _confusion(samples: Judged) -> list[tuple[str, str, float]]:
    """Return (metric, true label, count) of every label that is taken for another, borderline left out."""
    if not samples.names_causes:
        return []
    shown = samples.label != BORDERLINE
    none_named = samples.named == ""
    counts = confusion(samples.label[shown], samples.named[shown], none_named[shown], LABELS)
    return [
        (PREDICTED_AS + predicted, true, float(count))
        for true, row in zip(LABELS, counts, strict=True)
        for predicted, count in zip((*LABELS, ABSTAINED), row, strict=True)
        if row.sum()
    ]


def collect_intervals(prediction_files: Iterable[str | Path], causes_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return for every source, explainer and measure the value over all seeds and its 95 % interval.

    The rival is the best other explainer by that measure, and ``untrained`` the best of those that need no training;
    ``difference`` and ``gain`` are how far the explainer lies above them, on the same draws. The ceiling is no rival.
    """
    import pandas as pd

    rows: list[tuple] = []
    for source, samples_of in by_source(prediction_files, causes_files).items():
        rows += _of_source(source, samples_of)
    return pd.DataFrame(rows, columns=list(COLUMNS))


def read_intervals(path: str | Path) -> pd.DataFrame:
    """Read what :func:`collect_intervals` returned; where there is no other, the difference from it is NaN.

    Raises:
        InputError: missing, empty or unreadable file, missing column, a value that is no finite number.
    """
    return read_numbers(path, COLUMNS, NUMBERS, optional=NUMBERS[3:])


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
        explainer: {
            metric: of_explainer
            for metric, of_explainer in measured(samples, weights_B_N).items()
            if np.isfinite(of_explainer[0])
        }
        for explainer, samples in samples_of.items()
    }
    seeds = len(set(any_samples.seed.tolist()))
    rows = []
    for metric in metrics:
        of_metric = {name: of_explainer[metric] for name, of_explainer in values.items() if metric in of_explainer}
        rivals, smaller = [name for name in of_metric if name != CEILING], metric in SMALLER_IS_BETTER
        counted_N = counted(any_samples, metric)
        drawn_B_n = drawn_B_N[:, counted_N] if metric in SHARES else None
        for explainer, value_B in of_metric.items():
            lead = gain = Difference()
            if explainer != CEILING:
                lead = from_rival(of_metric, explainer, rivals, smaller, drawn_B_n)
                gain = from_untrained(of_metric, explainer, smaller, drawn_B_n)
            own = (source, explainer, metric, int(counted_N.sum()), seeds)
            rows.append((*own, *interval(value_B, drawn_B_n), *lead.cells, *gain.cells))
    return rows
