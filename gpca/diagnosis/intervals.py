"""Intervals of the measures over objects and seeds, and of the differences between explainers on the same samples.

Objects and seeds are crossed: an object is tested in several seeds, a seed tests several objects. The pigeonhole
bootstrap (Owen 2007) draws both with replacement and weighs a sample by the product of how often its own were drawn.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.csv_file import numbers, read_csv
from gpca.diagnosis.judged import CEILING, Judged, joined, read_judged
from gpca.diagnosis.measures import MEASURES, SMALLER_IS_BETTER, measure
from gpca.diagnosis.metrics import with_pooled
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

REPEATS = 500
LEVEL = 0.95
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
    rows = read_csv(path, COLUMNS)
    for column in COLUMNS:
        if column not in ("source", "method", "metric", "rival"):
            rows[column] = numbers(path, rows, column, needed=column in ("samples", "seeds", "value"))
    return rows


def _of_source(source: str, samples_of: dict[str, Judged]) -> list[tuple]:
    any_samples = next(iter(samples_of.values()))
    factors = (any_samples.seed, any_samples.instance)
    weights_B_N = np.vstack([np.ones(len(any_samples)), pigeonhole_weights(factors, "cause intervals", source)])
    values = {explainer: measure(samples, weights_B_N) for explainer, samples in samples_of.items()}
    seeds = len(set(any_samples.seed.tolist()))
    rows = []
    for metric in MEASURES:
        ranked = sorted(
            (explainer for explainer in values if explainer != CEILING and metric in values[explainer]),
            key=lambda explainer: values[explainer][metric][0] * (1 if metric in SMALLER_IS_BETTER else -1),
        )
        for explainer, found in values.items():
            if metric not in found:
                continue
            rival = next((name for name in ranked if name != explainer), "") if explainer != CEILING else ""
            apart = found[metric] - values[rival][metric] if rival else np.full(len(weights_B_N), np.nan)
            of_value, of_difference = bounds_of(found[metric][1:]), bounds_of(apart[1:])
            own = (source, explainer, metric, len(any_samples), seeds)
            rows.append((*own, found[metric][0], *of_value, rival, apart[0], *of_difference))
    return rows


def pigeonhole_weights(factors: Iterable[np.ndarray], *axes: object) -> np.ndarray:
    """Return how often each sample is drawn, (`REPEATS`, N), by crossed factors (N,), such as its seed and its object.

    Args:
        factors: every level of each is drawn as often as chance has it; a sample counts the product of its levels'.
        axes: name the draws; the same axes and levels give the same draws.
    """
    random = generator(*axes)
    weights_B_N: np.ndarray | None = None
    for factor_N in factors:
        names, number_N = np.unique(factor_N, return_inverse=True)
        drawn_B_K = random.multinomial(len(names), np.full(len(names), 1 / len(names)), size=REPEATS)
        own_B_N = drawn_B_K[:, number_N].astype(float)
        weights_B_N = own_B_N if weights_B_N is None else weights_B_N * own_B_N
    assert weights_B_N is not None
    return weights_B_N


def bounds_of(values_B: np.ndarray) -> tuple[float, float]:
    known = values_B[np.isfinite(values_B)]
    if not len(known):
        return np.nan, np.nan
    low, high = np.quantile(known, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return float(low), float(high)
