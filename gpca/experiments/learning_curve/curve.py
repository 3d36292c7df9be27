"""Learns from more and more samples, and judges each learner on the same test samples of unseen objects."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.predictions import prediction_frame
from gpca.attribution.scores import Attribution
from gpca.causes.dataset import LABELS, Causes
from gpca.causes.judged import CEILING, Judged, ceiling_of, judged_by, measure
from gpca.errors import InputError
from gpca.evaluation.measures import source_method_seed, tidy
from gpca.experiments.learning_curve.learners import TITLES, learn
from gpca.experiments.learning_curve.samples import Lessons
from gpca.experiments.learning_curve.settings import CurveSettings
from gpca.io.csv_file import numbers, read_csv
from gpca.process.progress import progress
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

TABLE = "learning_curve"  # `table` of the tidy rows reads this
MEASURED = ("balanced_accuracy", "regret", "tied_accuracy", "dominant_accuracy", "auroc_failed")
CURVE_COLUMNS = ("learner", "samples", "order", *MEASURED)


def learning_curve(
    pool: Lessons, tested: Lessons, truth: Causes, settings: CurveSettings, source: str, seed: int
) -> pd.DataFrame:
    """Return a row of `CURVE_COLUMNS` for each learner, size and order, and one of the truth from other starts.

    An order is a permutation of the pool; a smaller size is part of a larger one in the same order.

    Args:
        pool: all training samples.
        tested: the test samples, in the order of `truth`.
        truth: of these.

    Raises:
        InputError: fewer training samples than the largest size.
    """
    import pandas as pd

    if len(pool) < max(settings.sizes):
        fault = f"{len(pool)} training samples are fewer than the largest size, {max(settings.sizes)}"
        raise InputError(f"learning curve of {source}", fault, "raise learning_curve.further or lower its sizes")
    orders = [
        generator(source, seed, "learning curve", "order", i).permutation(len(pool)) for i in range(settings.orders)
    ]
    rows = [(CEILING, 0, 0, *_values(ceiling_of(truth, seed)))]
    fits = [(name, size, i) for size in sorted(settings.sizes) for i in range(settings.orders) for name in TITLES]
    for name, size, i in progress(fits, f"learning curve of {source}, seed {seed}"):
        scores = learn(name, pool.subset(orders[i][:size]), settings.classifier, source, seed, name, size, i)
        attribution = Attribution.of_scores(LABELS, scores(tested), seconds=0.0)
        judged = judged_by(prediction_frame(truth.registrations, attribution), truth, seed)
        rows.append((name, size, i, *_values(judged)))
    return pd.DataFrame(rows, columns=list(CURVE_COLUMNS))


def _values(judged: Judged) -> list[float]:
    measures = measure(judged, np.ones((1, len(judged))))
    return [float(measures[name][0]) for name in MEASURED]


def read_curves(files: Iterable[str | Path]) -> pd.DataFrame:
    """Read files named ``…/{source}/seed{seed}.csv`` into one frame with the further columns `source` and `seed`.

    Raises:
        InputError: no files, a missing column, something that is not a finite number.
    """
    import pandas as pd

    parts = []
    for path in files:
        _, source, seed = source_method_seed(path)
        rows = read_csv(path, CURVE_COLUMNS)
        for column in CURVE_COLUMNS[1:]:
            rows[column] = numbers(path, rows, column)
        parts.append(rows.assign(source=source, seed=seed))
    if not parts:
        raise InputError("learning curves", "no files were given", "name a source in learning_curve.sources")
    return pd.concat(parts, ignore_index=True)


def collect_curves(files: Iterable[str | Path]) -> pd.DataFrame:
    """Return tidy metrics, means over the orders; ``concept`` is the number of samples.

    Raises:
        InputError: where :func:`read_curves` raises one.
    """
    rows = read_curves(files)
    means = rows.groupby(["source", "learner", "samples", "seed"], sort=False)[list(MEASURED)].mean()
    records = [
        (TABLE, source, learner, metric, f"{samples:g}", seed, float(value))
        for (source, learner, samples, seed), of_row in means.iterrows()
        for metric, value in of_row.items()
    ]
    return tidy(records, "learning curves")
