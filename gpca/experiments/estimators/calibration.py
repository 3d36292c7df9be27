"""Turns estimates into metrics: how near they are to the reference, and how well they predict the error."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.metrics import source_method_seed, tidy
from gpca.experiments.estimators.covariances import read_estimates
from gpca.io.csv_file import numbers, read_csv

if TYPE_CHECKING:
    import pandas as pd

TABLE = "estimators"  # `table` of the tidy rows reads this
TIMED = "estimator_"  # with an estimator behind it, the folder of its seconds
TRIMMED = 0.1  # share that means leave out at either end, as Brossard et al. (2020) do
LEVEL = 0.95  # of the coverage


def collect_estimates(files: Iterable[str | Path]) -> pd.DataFrame:
    """Return the tidy metrics of files named `…/{source}/{estimator}/seed{seed}.csv`; results/README.md lists them.

    Their `concept` is the registration method. A metric that is not defined, such as the area where all registrations
    failed or none, has no row.

    Raises:
        InputError: no files, a name of another form, a missing column, no rows.
    """
    records = []
    for path in files:
        source, estimator, seed = source_method_seed(path)
        for method, rows in read_estimates(path).groupby("method", sort=False):
            for metric, value in measure(rows).items():
                if np.isfinite(value):
                    records.append((TABLE, source, estimator, metric, method, seed, float(value)))
    return tidy(records, "estimates")


def collect_estimate_seconds(files: Iterable[str | Path]) -> pd.DataFrame:
    """Return median `seconds`, tidy as the metrics, of files `…/{source}/estimator_{name}/seed{seed}.csv`.

    Apart from the metrics, because times differ from run to run and metrics must not.
    """
    records = []
    for path in files:
        source, folder, seed = source_method_seed(path)
        rows = read_csv(path, ("sample", "method", "seconds"))
        rows["seconds"] = numbers(path, rows, "seconds", least=0)
        for method, middle in rows.groupby("method", sort=False)["seconds"].median().items():
            records.append((TABLE, source, folder.removeprefix(TIMED), "seconds", method, seed, float(middle)))
    return tidy(records, "seconds of estimators")


def measure(rows: pd.DataFrame) -> dict[str, float]:
    """Return the metrics of the registrations of one estimator; NaN where one is not defined.

    - kl_rotation, kl_translation: KL divergence of the estimate from the reference, nats, trimmed mean.
    - nne: √ of the trimmed mean of |e|² / tr Σ, the normalized norm error; 1 is right, more is too sure.
    - nees: trimmed mean of eᵀΣ⁻¹e / 6; 1 is right, more is too sure.
    - coverage: share whose eᵀΣ⁻¹e is within the 95 % quantile of χ² with six degrees.
    - auroc_failed: how well the predicted spread of the points tells failed registrations from the others.
    - spearman_error: of the predicted spread and the error.
    - no_estimate: share that it refused or failed at; the other numbers are of the rest.
    - test_samples: all of them.
    """
    from scipy.stats import chi2, trim_mean

    estimated = rows[rows["failure"] == ""]
    metrics = {"no_estimate": 1 - len(estimated) / len(rows), "test_samples": float(len(rows))}
    if estimated.empty:
        return metrics
    for name in ("kl_rotation", "kl_translation"):
        known = estimated[name].dropna()
        metrics[name] = float(trim_mean(known, TRIMMED)) if len(known) else np.nan
    metrics["nne"] = float(np.sqrt(trim_mean(estimated["error_ratio"], TRIMMED)))
    metrics["nees"] = float(trim_mean(estimated["mahalanobis"], TRIMMED) / 6)
    metrics["coverage"] = float((estimated["mahalanobis"] <= chi2.ppf(LEVEL, 6)).mean())
    metrics["auroc_failed"] = _area(estimated["spread"].to_numpy(), estimated["failed"].to_numpy())
    metrics["spearman_error"] = _correlation(estimated["spread"].to_numpy(), estimated["add_relative"].to_numpy())
    return metrics


def _area(score_S: np.ndarray, positive_S: np.ndarray) -> float:
    """Return the area under the ROC curve; NaN where there is but one class."""
    from sklearn.metrics import roc_auc_score

    return float(roc_auc_score(positive_S, score_S)) if 0 < positive_S.sum() < len(positive_S) else np.nan


def _correlation(a_S: np.ndarray, b_S: np.ndarray) -> float:
    from scipy.stats import spearmanr

    if len(a_S) < 3 or np.ptp(a_S) == 0 or np.ptp(b_S) == 0:
        return np.nan
    return float(spearmanr(a_S, b_S).statistic)
