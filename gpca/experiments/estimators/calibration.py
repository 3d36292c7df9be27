"""Turns estimates into metrics: how near they are to each reference and to the error, and how well they tell failures.

Registrations that failed stand apart from the others: an estimator that is right about the ones and wrong about the
others looks mediocre where they are mixed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.causes.judged import ranking
from gpca.evaluation.intervals import interval, pigeonhole_weights
from gpca.evaluation.measures import source_method_seed, tidy
from gpca.experiments.estimators.covariances import read_estimate_files, reference_name
from gpca.experiments.estimators.settings import KINDS
from gpca.io.csv_file import numbers, read_csv, read_numbers
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

TABLE = "estimators"  # `table` of the tidy rows reads this
TIMED = "estimator_"  # with an estimator behind it, the folder of its seconds
TRIMMED = 0.1  # share that means leave out at either end, as Brossard et al. (2020) do
LEVEL = 0.95  # of the coverage
TRUTH = "truth"  # in the place of a kind of reference: the error of the pose
SUCCEEDED, FAILED, BOTH = "succeeded", "failed", "both"
STATES = (SUCCEEDED, FAILED, BOTH)
GATES = {"gate_rmse": "Inlier RMSE (gate)", "gate_fitness": "Fitness (gate)"}  # scores that need no estimator
FEWEST_FAMILIES = 3  # over which there is an interval
SPREAD_GATE = "monte_carlo"  # and the gate by the spread of the starts, which is an estimator as well
OF_BOTH = ("auroc_failed", "spearman_error")  # metrics that need registrations of both kinds
COLUMNS = (
    *("method", "state", "estimator", "metric", "samples", "seeds", "value", "low", "high"),
    *("rival", "difference", "difference_low", "difference_high"),
)


def collect_estimates(files: Iterable[str | Path]) -> pd.DataFrame:
    """Return the tidy metrics of files named `…/{source}/{estimator}/seed{seed}.csv`; results/README.md lists them.

    Their `concept` is the registration method and the state. A metric that is not defined, such as the area where all
    registrations failed or none, has no row.

    Raises:
        InputError: no files, a name of another form, a missing column, no rows.
    """
    records = []
    for (source, estimator, seed), rows in read_estimate_files(files).items():
        for method, of_method in rows.groupby("method", sort=False):
            for state, chosen_N in of_state(of_method).items():
                if not chosen_N.any():
                    continue
                for metric, value_1 in measure(of_method, chosen_N[None].astype(float)).items():
                    if np.isfinite(value_1[0]) and (state == BOTH) == (metric in OF_BOTH):
                        concept = f"{method}/{state}"
                        records.append((TABLE, source, estimator, metric, concept, seed, float(value_1[0])))
    return tidy(records, "estimates")


def collect_intervals(files: Iterable[str | Path]) -> pd.DataFrame:
    """Return every metric over all sources and seeds, with the 95 % interval of a bootstrap over families and seeds.

    Rows of `COLUMNS`. Of the area under the ROC curve, the rival is the best gate on the same registrations, and the
    difference from it is that of the same draws.
    """
    import pandas as pd

    rows = pooled(read_estimate_files(files))
    records: list[tuple] = []
    for method in dict.fromkeys(rows[reference_name(KINDS[0])]["method"]):
        of_method = {
            name: own[own["method"] == method].reset_index(drop=True)
            for name, own in rows.items()
            if (own["method"] == method).any()
        }
        records += _of_method(method, of_method)
    return pd.DataFrame(records, columns=list(COLUMNS))


def read_intervals(path: str | Path) -> pd.DataFrame:
    """Read what :func:`collect_intervals` returned; where there is no rival, the difference is NaN.

    Raises:
        InputError: missing, empty or unreadable file, missing column, a value that is no finite number.
    """
    return read_numbers(path, COLUMNS, (*COLUMNS[4:9], *COLUMNS[10:]), optional=(*COLUMNS[7:9], *COLUMNS[10:]))


def collect_estimate_seconds(files: Iterable[str | Path]) -> pd.DataFrame:
    """Return estimator, method and the median seconds of files `…/{source}/estimator_{name}/seed{seed}.csv`.

    Apart from the metrics, because times differ from run to run and metrics must not.
    """
    import pandas as pd

    parts = []
    for path in files:
        rows = read_csv(path, ("sample", "method", "seconds"))
        seconds = numbers(path, rows, "seconds", least=0)
        parts.append(rows.assign(seconds=seconds, estimator=source_method_seed(path)[1].removeprefix(TIMED)))
    return pd.concat(parts).groupby(["estimator", "method"], sort=False)["seconds"].median().reset_index()


def pooled(rows_of: Mapping[tuple[str, str, int], pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """Return estimator -> the rows of all its sources and seeds, which become columns."""
    import pandas as pd

    parts: dict[str, list[pd.DataFrame]] = {}
    for (source, estimator, seed), rows in rows_of.items():
        parts.setdefault(estimator, []).append(rows.assign(source=source, seed=seed))
    return {estimator: pd.concat(own, ignore_index=True) for estimator, own in parts.items()}


def of_state(rows: pd.DataFrame) -> dict[str, np.ndarray]:
    """Return which rows (N,) are of each state."""
    failed_N = rows["failed"].to_numpy()
    return {SUCCEEDED: ~failed_N, FAILED: failed_N, BOTH: np.ones(len(rows), bool)}


def measure(rows: pd.DataFrame, weights_B_N: np.ndarray) -> dict[str, np.ndarray]:
    """Return the metrics (B,) of registrations by their weights (B, N); NaN where one is not defined.

    Of each kind of reference, and of the true pose (`truth`) but for the divergences:

    - kl_rotation, kl_translation: KL divergence of the estimate from the reference, nats, trimmed mean.
    - nne: √ of the trimmed mean of |e|² / tr Σ, the normalized norm error; 1 is right, more is too sure.
    - nees: trimmed mean of eᵀΣ⁻¹e / 6; 1 is right, more is too sure.
    - coverage: share of the results, or of the true poses, within the 95 % region of Σ.

    Of all: no_estimate, the share that it refused or failed at, which the others leave out; test_samples, all of them.
    With registrations of both states: auroc_failed, how well the predicted spread tells failed registrations from the
    others; spearman_error, of spread and error, unweighted.
    """
    from scipy.stats import chi2

    has_N = (rows["failure"] == "").to_numpy()
    total_B = weights_B_N.sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        metrics = {"no_estimate": 1 - weights_B_N[:, has_N].sum(axis=1) / total_B, "test_samples": total_B}
    if not weights_B_N[:, has_N].any():
        return metrics
    rows, weights_B_N = rows[has_N], weights_B_N[:, has_N]
    for kind in (*KINDS, TRUTH):
        of = {name: rows[name if kind == TRUTH else f"{name}_{kind}"] for name in ("error_ratio", "mahalanobis")}
        if kind != TRUTH:
            for name in ("kl_rotation", "kl_translation"):
                metrics[f"{name}_{kind}"] = trimmed_mean(rows[f"{name}_{kind}"], weights_B_N)
        metrics[f"nne_{kind}"] = np.sqrt(trimmed_mean(of["error_ratio"], weights_B_N))
        metrics[f"nees_{kind}"] = trimmed_mean(of["mahalanobis"], weights_B_N) / 6
        within = of["mahalanobis"] <= chi2.ppf(LEVEL, 6) if kind == TRUTH else rows[f"covered_{kind}"]
        metrics[f"coverage_{kind}"] = trimmed_mean(within.astype(float), weights_B_N, trimmed=0)
    spread_N, failed_N = rows["spread"].to_numpy(), rows["failed"].to_numpy()
    metrics["auroc_failed"] = ranking(spread_N, failed_N, weights_B_N)["area"]
    metrics["spearman_error"] = np.full(len(weights_B_N), np.nan)
    metrics["spearman_error"][0] = _correlation(spread_N, rows["add_relative"].to_numpy())
    return metrics


def trimmed_mean(values: pd.Series, weights_B_N: np.ndarray, trimmed: float = TRIMMED) -> np.ndarray:
    """Return the means (B,) over the middle of the weight, a share left out at either end; NaNs are ignored."""
    values_N = values.to_numpy(float)
    known_n = np.flatnonzero(np.isfinite(values_N))
    order_n = known_n[np.argsort(values_N[known_n], kind="stable")]
    if not len(order_n):
        return np.full(len(weights_B_N), np.nan)
    upper_B_n = np.cumsum(weights_B_N[:, order_n], axis=1)
    total_B_1 = upper_B_n[:, -1:]
    lower_B_n = upper_B_n - weights_B_N[:, order_n]
    kept_B_n = np.minimum(upper_B_n, (1 - trimmed) * total_B_1) - np.maximum(lower_B_n, trimmed * total_B_1)
    kept_B_n = np.maximum(kept_B_n, 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return (kept_B_n * values_N[order_n]).sum(axis=1) / kept_B_n.sum(axis=1)


def _of_method(method: str, rows_of: Mapping[str, pd.DataFrame]) -> list[tuple]:
    """Return the records of one method; all estimators have the same registrations in the same order."""
    any_rows = next(iter(rows_of.values()))
    cluster_N = (any_rows["source"] + "/" + any_rows["cluster"]).to_numpy()
    drawn_B_N = pigeonhole_weights(generator("estimator intervals", method), any_rows["seed"].to_numpy(), cluster_N)
    weights_B_N = np.vstack([np.ones(len(any_rows)), drawn_B_N])
    seeds = any_rows["seed"].nunique()
    records = []
    for state, chosen_N in of_state(any_rows).items():
        for name, rows in {**rows_of, **_gates(any_rows)}.items():
            has_N = chosen_N & (rows["failure"] == "").to_numpy()
            for metric, value_B in measure(rows, weights_B_N * chosen_N).items():
                is_shown = metric != "test_samples" and (state == BOTH) == (metric in OF_BOTH)
                if not is_shown or not np.isfinite(value_B[0]):
                    continue
                counted = int((chosen_N if metric == "no_estimate" else has_N).sum())
                compared = ("", np.nan, np.nan, np.nan)
                if metric == "auroc_failed":
                    compared = _lead(name, value_B, rows_of, any_rows, weights_B_N * has_N)
                enough = len(set(cluster_N[has_N])) >= FEWEST_FAMILIES
                own_n = drawn_B_N[:, has_N] if metric.startswith("coverage_") else None
                estimate = interval(value_B, own_n) if enough else (value_B[0], np.nan, np.nan)
                own = (method, state, name, metric, counted, seeds, *estimate)
                records.append((*own, *compared))
    return [record for record in records if record[2] not in GATES or record[3] in OF_BOTH]


def _lead(
    name: str, area_B: np.ndarray, rows_of: Mapping[str, pd.DataFrame], any_rows: pd.DataFrame, weights_B_N: np.ndarray
) -> tuple[str, float, float, float]:
    """Return the best other gate on the registrations that have a weight, and how much larger an area is than its."""
    gates = _gates(any_rows) | ({SPREAD_GATE: rows_of[SPREAD_GATE]} if SPREAD_GATE in rows_of else {})
    failed_N = any_rows["failed"].to_numpy()
    areas = {}
    for gate, rows in gates.items():
        score_N = rows["spread"].fillna(np.inf).to_numpy()
        areas[gate] = ranking(score_N, failed_N, weights_B_N)["area"]
    best = max((gate for gate in areas if gate != name), key=lambda gate: areas[gate][0])
    apart_B = area_B - areas[best]
    return best, *interval(apart_B)


def _gates(rows: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Return the registrations with a gate's score as their spread; without correspondences it is the largest."""
    found = rows["fitness"] > 0
    scores = {"gate_rmse": rows["inlier_rmse"], "gate_fitness": -rows["fitness"]}
    return {name: rows.assign(failure="", spread=score.where(found, np.inf)) for name, score in scores.items()}


def _correlation(a_S: np.ndarray, b_S: np.ndarray) -> float:
    from scipy.stats import spearmanr

    if len(a_S) < 3 or (a_S == a_S[0]).all() or (b_S == b_S[0]).all():
        return np.nan
    return float(spearmanr(a_S, b_S).statistic)
