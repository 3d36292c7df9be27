"""Kernel × learning rate × iterations (paper, Table IV): one fit per kernel and rate, judged on its way."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np

from gpca.attribution.diagnostics import calibration_error, negative_log_likelihood
from gpca.attribution.predictions import prediction_frame
from gpca.attribution.scores import Attribution
from gpca.classifier.settings import Draws, Kernel, LearningRate
from gpca.errors import InputError
from gpca.evaluation.measures import ALL, source_method_seed, tidy
from gpca.io.csv_file import numbers, read_csv, write_csv
from gpca.settings import Count, Different, Distinct

if TYPE_CHECKING:
    import pandas as pd

    from gpca.classifier.gpc import GPC
    from gpca.classifier.gpytorch_classes import GpytorchGPC
    from gpca.pairs.dataset import Registrations

MEASURES = ("accuracy", "elbo", "confidence", "ece", "nll")
TABLE = "kernels"  # `table` of the tidy rows reads this
SETTING = ("kernel", "learning_rate", "iterations")
GRID_COLUMNS = (*SETTING, *MEASURES)
PRINTED: tuple[tuple[Kernel, float, int], ...] = (  # The paper's table has these rows.
    ("rbf", 0.01, 100),
    ("matern32", 0.01, 200),
    ("polynomial", 0.01, 200),
    ("rbf", 0.001, 200),
    ("polynomial", 0.001, 200),
)
BY_GPYTORCH = "_gpytorch"  # ends the name of a kernel whose fit is in gpytorch's own classes


@dataclass(frozen=True)
class KernelGrid:
    """The kernels and learning rates that are fitted, and the iterations at which they are judged.

    Attributes:
        kernels, learning_rates: every kernel is fitted at every rate.
        iterations: counts at which the classifier is judged; it is fitted up to the largest.
        gpytorch: kernels that are fitted once more in gpytorch's own classes, to be compared: as printed, at the larger
            rate, where rate and iterations are in the grid.
        inducing, draws: see :class:`gpca.classifier.gpc.GPCSettings`.
    """

    kernels: Distinct[Kernel] = ("rbf", "matern32", "polynomial")
    learning_rates: Distinct[LearningRate] = (0.01, 0.001)
    iterations: Distinct[Count] = (10, 20, 50, 100, 200)
    gpytorch: Annotated[tuple[Kernel, ...], Different(fewest=0)] = ()
    inducing: Count = 64
    draws: Draws = 1000


def evaluate_grid(
    registrations: Registrations, grid: KernelGrid, source: str, seed: int
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the rows of :data:`GRID_COLUMNS`, and the predictions of the test samples that they are judged by.

    Each row is what a fit of that many iterations to the training samples alone would give. `elbo` is per training
    sample in nats, `confidence` the mean of the largest score. The predictions have the columns of a prediction file
    after `SETTING`.

    Raises:
        InputError: no training or no test samples.
    """
    import pandas as pd

    from gpca.pairs.perturbation import CONCEPTS

    train, test = registrations.rows("train"), registrations.rows("test")
    if not len(train) or not len(test):
        raise InputError(f"registrations of {source}, seed {seed}", "lack a split", "give training and test samples")
    h_S_d = registrations.embedding
    concept_S = registrations.concept
    target_N = np.array([CONCEPTS.index(concept) for concept in concept_S[test]])
    tested, predictions = registrations.subset(test), []
    rows = []
    for name, rate, counts, gpc in _fits(grid, source, seed):
        for iterations in gpc.fit_up_to(counts, h_S_d[train], concept_S[train]):
            scores_N_C, variances_N_C, bald_N = gpc.attribute(h_S_d[test])
            attribution = Attribution.of_scores(
                CONCEPTS, scores_N_C, seconds=0.0, variances_N_C=variances_N_C, bald_N=bald_N
            )
            setting = dict(zip(SETTING, (name, rate, iterations), strict=True))
            predictions.append(prediction_frame(tested, attribution).assign(**setting))
            judged = (
                np.mean(scores_N_C.argmax(axis=1) == target_N),
                gpc.elbo(),
                scores_N_C.max(axis=1).mean(),
                calibration_error(scores_N_C, target_N),
                negative_log_likelihood(scores_N_C, target_N),
            )
            rows.append((name, rate, iterations, *judged))
    of_samples = pd.concat(predictions, ignore_index=True)
    return pd.DataFrame(rows, columns=list(GRID_COLUMNS)), of_samples[[*SETTING, *of_samples.columns.drop([*SETTING])]]


def _fits(grid: KernelGrid, source: str, seed: int) -> Iterator[tuple[str, float, tuple[int, ...], GPC | GpytorchGPC]]:
    """Yield name, learning rate, counts of iterations and classifier of every fit."""
    from gpca.classifier.gpc import GPC
    from gpca.classifier.gpytorch_classes import GpytorchGPC
    from gpca.classifier.settings import GPCSettings
    from gpca.pairs.perturbation import CONCEPTS

    for kernel in grid.kernels:
        for rate in grid.learning_rates:
            settings = GPCSettings(kernel, rate, max(grid.iterations), grid.inducing, grid.draws)
            yield kernel, rate, grid.iterations, GPC(CONCEPTS, settings, source, seed)
    largest = max(rate for _, rate, _ in PRINTED)
    for kernel, rate, iterations in PRINTED:
        in_grid = rate in grid.learning_rates and iterations in grid.iterations
        if kernel in grid.gpytorch and rate == largest and in_grid:
            settings = GPCSettings(kernel, rate, iterations, grid.inducing, grid.draws)
            yield kernel + BY_GPYTORCH, rate, (iterations,), GpytorchGPC(CONCEPTS, settings, source, seed)


def write_grid(path: str | Path, rows: pd.DataFrame) -> None:
    """Write the rows that :func:`evaluate_grid` returned."""
    write_csv(path, rows)


def read_grids(files: Iterable[str | Path]) -> pd.DataFrame:
    """Read files named `…/{source}/seed{seed}.csv` into one frame with the further columns `source` and `seed`.

    Raises:
        InputError: no files, a name of another form, a missing column, something that is not a finite number.
    """
    import pandas as pd

    parts = []
    for path in files:
        _, source, seed = source_method_seed(path)
        rows = read_csv(path, GRID_COLUMNS)
        for column in GRID_COLUMNS[1:]:
            rows[column] = numbers(path, rows, column)
        parts.append(rows.assign(source=source, seed=seed, iterations=rows["iterations"].astype(int)))
    if not parts:
        raise InputError("kernels", "no files were given", "name a source in kernel_grid.sources")
    return pd.concat(parts, ignore_index=True)


def collect_grids(files: Iterable[str | Path]) -> pd.DataFrame:
    """Return the tidy metrics (`MEASURES`) of files named `…/{source}/seed{seed}.csv`.

    Their `method` is as :func:`setting_name` has it.

    Raises:
        InputError: where :func:`read_grids` raises one.
    """
    records = [
        (TABLE, row.source, setting_name(row.kernel, row.learning_rate, row.iterations), measure, ALL, row.seed, value)
        for row in read_grids(files).itertuples()
        for measure in MEASURES
        for value in [float(getattr(row, measure))]
    ]
    return tidy(records, "kernels")


def setting_name(kernel: str, learning_rate: float, iterations: int) -> str:
    """Return e.g. ``rbf-0.01-100``."""
    return f"{kernel}-{learning_rate:g}-{iterations}"
