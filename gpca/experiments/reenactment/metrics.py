"""Turns what oracles say into measures, with their intervals and their differences from the estimate."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.causes.judged import SHARES, Judged, counted, measure
from gpca.evaluation.intervals import Difference, difference, interval, pigeonhole_weights
from gpca.experiments.diagnosis.metrics import by_source
from gpca.experiments.reenactment.knowledge import NOTHING
from gpca.io.csv_file import read_numbers
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

MEASURED = ("balanced_accuracy", "dominant_accuracy", "auroc_failed", "regret", "false_alarm_rate")
ORACLE_COLUMNS = (
    *("source", "known", "metric", "samples", "seeds", "value", "low", "high"),
    *("difference", "difference_low", "difference_high"),
)


def collect_oracles(prediction_files: Iterable[str | Path], causes_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return `MEASURED` for every source and all together, by what is known, with 95 % intervals.

    The difference is that from what knows nothing, on the same draws; the truth from other starts has one, too.

    Raises:
        InputError: see :func:`gpca.causes.judged.read_judged`.
    """
    import pandas as pd

    rows: list[tuple] = []
    for source, samples_of in by_source(prediction_files, causes_files).items():
        rows += _of_source(source, samples_of)
    return pd.DataFrame(rows, columns=list(ORACLE_COLUMNS))


def read_oracles(path: str | Path) -> pd.DataFrame:
    """Read what :func:`collect_oracles` returned; what knows nothing has no difference.

    Raises:
        InputError: missing, empty or unreadable file, missing column, a value that is no finite number.
    """
    return read_numbers(path, ORACLE_COLUMNS, ORACLE_COLUMNS[3:], optional=ORACLE_COLUMNS[6:])


def _of_source(source: str, samples_of: dict[str, Judged]) -> list[tuple]:
    any_samples = next(iter(samples_of.values()))
    drawn_B_N = pigeonhole_weights(generator("oracle intervals", source), any_samples.seed, any_samples.instance)
    weights_B_N = np.vstack([np.ones(len(any_samples)), drawn_B_N])
    measures = {name: measure(samples, weights_B_N) for name, samples in samples_of.items()}
    seeds, rows = len(set(any_samples.seed.tolist())), []
    for metric in MEASURED:
        counted_N = counted(any_samples, metric)
        drawn_B_n = drawn_B_N[:, counted_N] if metric in SHARES else None
        values = {name: of_name[metric] for name, of_name in measures.items() if np.isfinite(of_name[metric][0])}
        for name, value_B in values.items():
            gain = Difference() if name == NOTHING else difference(values, name, NOTHING, drawn_B_n)
            own = (source, name, metric, int(counted_N.sum()), seeds, *interval(value_B, drawn_B_n))
            rows.append((*own, *gain.cells[1:]))
    return rows
