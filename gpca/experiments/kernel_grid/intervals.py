"""Accuracy and calibration of every kernel and schedule over all seeds, with intervals over families of objects."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.attribution.predictions import read_predictions
from gpca.evaluation.intervals import Clustered
from gpca.evaluation.measures import ALL, intervals, source_method_seed
from gpca.experiments.kernel_grid.grid import MEASURES, SETTING, TABLE, setting_name
from gpca.experiments.out_of_distribution.intervals import estimates_of_scores
from gpca.io.csv_file import numbers

if TYPE_CHECKING:
    import pandas as pd


def collect_intervals(prediction_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return the measures of the grid but the ELBO, with 95 % intervals (:mod:`gpca.evaluation.measures`).

    The `method` is as :func:`gpca.experiments.kernel_grid.grid.setting_name` has it. The draws of a source are the same
    for all settings.

    Args:
        prediction_files: named `…/{source}/seed{seed}.csv`, with `SETTING` before the columns of predictions.

    Raises:
        InputError: no files, a name of another form, a file that cannot be read.
    """
    import pandas as pd

    parts: dict[str, list[pd.DataFrame]] = {}
    for path in prediction_files:
        _, source, seed = source_method_seed(path)
        rows = read_predictions(path, SETTING)
        setting = {name: numbers(path, rows, name) for name in SETTING[1:]}
        parts.setdefault(source, []).append(rows.assign(seed=seed, **setting))
    records = []
    for source, of_seeds in parts.items():
        for (kernel, rate, iterations), rows in pd.concat(of_seeds).groupby([*SETTING], sort=False):
            samples = Clustered.drawn(rows["seed"], rows["cluster"], "kernel intervals", source)
            estimates = estimates_of_scores(rows, samples)
            keys = TABLE, source, setting_name(kernel, rate, int(iterations))
            records += [samples.record((*keys, name, ALL), estimates[name]) for name in MEASURES if name in estimates]
    return intervals(records, "kernels")
