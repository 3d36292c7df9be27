"""How well explainers do on parts of the test samples: by margin, number of causes, symmetry, error and state."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.causes.judged import Judged, of_decisions
from gpca.causes.truth import ALL, BORDERLINE, FAILED, NOMINAL
from gpca.evaluation.intervals import pigeonhole_weights
from gpca.evaluation.measures import POOLED
from gpca.experiments.diagnosis.metrics import COLUMNS, NUMBERS, by_source, rows_of
from gpca.io.csv_file import read_numbers
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

STRATUM_COLUMNS = ("kind", "stratum", *COLUMNS)
DECISIONS = ("named_right", "regret")
SMALL_MARGIN, LARGE_MARGIN = 0.01, 0.03  # diameters
SMALL_ERROR, LARGE_ERROR = 0.05, 0.10


def strata_of(samples: Judged) -> dict[tuple[str, str], np.ndarray]:
    """Return (kind, stratum) -> mask (N,) of its samples; all but the states divide the failed."""
    nominal_N = samples.label == NOMINAL
    failed_N = ~nominal_N & (samples.label != BORDERLINE)
    margin_N, error_N, number_N = samples.margin, samples.error[:, ALL], samples.causes.sum(axis=1)
    of_failed = {
        ("margin", "small"): margin_N < SMALL_MARGIN,
        ("margin", "middle"): (margin_N >= SMALL_MARGIN) & (margin_N < LARGE_MARGIN),
        ("margin", "large"): margin_N >= LARGE_MARGIN,
        ("causes", "one"): number_N <= 1,
        ("causes", "two"): number_N == 2,
        ("causes", "three"): number_N == 3,
        ("symmetry", "symmetric"): samples.symmetric,
        ("symmetry", "other"): ~samples.symmetric,
        ("error", "small"): error_N < SMALL_ERROR,
        ("error", "middle"): (error_N >= SMALL_ERROR) & (error_N < LARGE_ERROR),
        ("error", "large"): error_N >= LARGE_ERROR,
        ("shown", "failed"): samples.shown == FAILED,
        ("shown", "other"): samples.shown != FAILED,
    }
    states = {("state", "nominal"): nominal_N, ("state", "failed"): failed_N}
    return states | {stratum: of_N & failed_N for stratum, of_N in of_failed.items()}


def collect_strata(prediction_files: Iterable[str | Path], causes_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return `DECISIONS` of every explainer in every stratum that has samples, over all sources and seeds.

    The columns after the first two are those of :func:`gpca.experiments.diagnosis.metrics.collect_intervals`.

    Raises:
        InputError: see :func:`gpca.causes.judged.read_judged`.
    """
    import pandas as pd

    samples_of = by_source(prediction_files, causes_files)
    pooled = POOLED if POOLED in samples_of else next(iter(samples_of))
    return pd.DataFrame(_rows(pooled, samples_of[pooled]), columns=list(STRATUM_COLUMNS))


def read_strata(path: str | Path) -> pd.DataFrame:
    """Read what :func:`collect_strata` returned; where there is no rival, the difference is NaN.

    Raises:
        InputError: missing, empty or unreadable file, missing column, a value that is no finite number.
    """
    return read_numbers(path, STRATUM_COLUMNS, NUMBERS, optional=NUMBERS[3:])


def _rows(source: str, samples_of: Mapping[str, Judged]) -> list[tuple]:
    any_samples = next(iter(samples_of.values()))
    drawn_B_N = pigeonhole_weights(generator("cause strata", source), any_samples.seed, any_samples.instance)
    rows: list[tuple] = []
    for stratum, of_N in strata_of(any_samples).items():
        inside = {explainer: samples.subset(of_N) for explainer, samples in samples_of.items() if samples.names_causes}
        if of_N.any() and inside:
            rows += [(*stratum, *row) for row in rows_of(source, inside, drawn_B_N[:, of_N], of_decisions, DECISIONS)]
    return rows
