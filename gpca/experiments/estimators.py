"""Estimators of a pose's covariance against further registrations and against the error (Table XII)."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import numpy as np

from gpca.alignment.methods.registry import method_module, methods, require_local
from gpca.causes.judged import ranking
from gpca.declarations import ByName, Experiment, Frame, LeftOut, Names, Paths, Plan, Run, Series, Step, numbers
from gpca.errors import InputError, with_key
from gpca.evaluation.intervals import best_of
from gpca.evaluation.measures import Clustered, interval, source_method_seed, tidy
from gpca.io import csv_file
from gpca.settings import part_of
from gpca.uncertainty.estimates import KINDS, REFERENCES, EstimatorPairSettings, read_estimate_files
from gpca.uncertainty.estimators import registry


def check(config: dict, _left_out: LeftOut) -> None:
    """Check that every estimator takes its settings, and that the methods are ones that start at an initial pose."""
    for name, settings in config["estimators"].items():
        with_key(f"estimators.{name}", registry.require_estimator_settings, name, settings or {})
    if not config["estimator_pairs"]["methods"]:
        raise InputError("config key estimator_pairs.methods", "is empty", "name a method, such as point_to_point")
    for name in config["estimator_pairs"]["methods"]:
        with_key(f"estimator_pairs.methods.{name}", require_local, name)


EXPERIMENT = Experiment(
    name="estimators",
    beside=("estimator_tables",),
    sections={
        "estimators": ByName,
        "estimator_pairs": Annotated[dict, part_of(EstimatorPairSettings, without=("failed",))],  # in success.error
    },
    names=lambda config, sources: {
        "estimator": list(config["estimators"]),
        "estimate": [*REFERENCES, *config["estimators"]],
    },
    check=check,
    optional_entries={
        "estimators": Names("estimator", registry.estimators),
        "estimator_pairs.methods": Names("registration method", methods),
    },
)


def _asked(plan: Plan) -> list[str]:
    """Estimators whose estimates the jobs of a rule write."""
    return [name for name in plan.names["estimate"] if name not in REFERENCES]


ESTIMATE = Step(
    name="estimate",
    run="gpca.steps.estimates",
    inputs={"objects": "objects/{source}.npz", "causes": "causes/{source}/seed{*seed}.npz"},
    outputs={
        "rows": "estimates/{source}/{*estimate}/seed{*seed}.csv",
        "timings": "timings/{source}/estimator_{*estimate}/seed{*seed}.csv",
    },
    settings=lambda plan, _wildcards: {
        **{name: plan.config[name] for name in ("estimator_pairs", "causes", "success")},
        "icp": plan.config["registrations"]["icp"],
        "estimators": {name: plan.config["estimators"][name] for name in _asked(plan)},
    },
    params={"estimators": lambda plan, _wildcards: _asked(plan)},
    modules=lambda plan: [
        *map(registry.estimator_module, _asked(plan)),
        *map(method_module, plan.config["estimator_pairs"]["methods"]),
    ],
    target="estimates",
    priority=2,
)

TABLE = "estimators"  # `table` of the tidy rows
TRIMMED = 0.1  # share that means leave out at either end, as Brossard et al. (2020) do
LEVEL = 0.95  # of the coverage
TRUTH = "truth"  # in the place of a kind of reference: the error of the pose
SUCCEEDED, FAILED, BOTH = "succeeded", "failed", "both"
GATES = {"gate_rmse": "Inlier RMSE (gate)", "gate_fitness": "Fitness (gate)"}  # scores that need no estimator
SPREAD_GATE = "monte_carlo"  # and the gate by the spread of the starts, which is an estimator as well
FEWEST_FAMILIES = 3  # over which there is an interval
OF_BOTH = ("auroc_failed", "spearman_error")  # metrics that need registrations of both kinds
COLUMNS = (
    *("method", "state", "estimator", "metric", "samples", "seeds", "value", "low", "high"),
    *("rival", "difference", "difference_low", "difference_high"),
)
FILES = "estimates/{source}/{estimate}/seed{seed}.csv"


@numbers("estimators.csv", rule="estimator_metrics", files=FILES)
def collect_estimates(_run: Run, files: Paths) -> Frame:
    """Metrics by source, estimator and seed; results/README.md lists them. One that is not defined has no row."""
    records = []
    for (source, estimator, seed), rows in read_estimate_files(files).items():
        for method, of_method in rows.groupby("method", sort=False):
            for state, chosen_N in of_state(of_method).items():
                metrics = measure(of_method, chosen_N[None].astype(float)) if chosen_N.any() else {}
                for metric, value_1 in metrics.items():
                    if np.isfinite(value_1[0]) and (state == BOTH) == (metric in OF_BOTH):
                        concept = f"{method}/{state}"
                        records.append((TABLE, source, estimator, metric, concept, seed, float(value_1[0])))
    return tidy(records, "estimates")


@numbers("estimator_intervals.csv", files=FILES)
def collect_intervals(_run: Run, files: Paths) -> Frame:
    """Metrics over all sources and seeds with intervals; of the area, the difference from the best gate (rival)."""
    import pandas as pd

    together = pd.concat(
        rows.assign(source=source, estimator=estimator, seed=seed)
        for (source, estimator, seed), rows in read_estimate_files(files).items()
    )
    records = []
    for method, trials in together.groupby("method", sort=False):
        by_estimator = trials.groupby("estimator", sort=False)
        records += _compare(str(method), {str(name): rows.reset_index(drop=True) for name, rows in by_estimator})
    return pd.DataFrame(records, columns=list(COLUMNS))


def _compare(method: str, rows_of: Mapping[str, Frame]) -> list[tuple]:
    """Records of one method; all estimators have the same registrations in the same order."""
    known = next(iter(rows_of.values()))
    cluster_N = (known["source"] + "/" + known["cluster"]).to_numpy()
    draws = Clustered.drawn(known["seed"], cluster_N, "estimator intervals", method)
    matched = known["fitness"] > 0  # without correspondences, a gate's score is the largest
    gates = {
        name: known.assign(failure="", spread=score.where(matched, np.inf))
        for name, score in (("gate_rmse", known["inlier_rmse"]), ("gate_fitness", -known["fitness"]))
    }
    rivals = gates | {name: rows for name, rows in rows_of.items() if name == SPREAD_GATE}
    scores = {name: rows["spread"].fillna(np.inf).to_numpy() for name, rows in rivals.items()}
    failed_N, records = known["failed"].to_numpy(), []
    for state, chosen_N in of_state(known).items():
        for name, rows in {**rows_of, **gates}.items():
            has_N = chosen_N & (rows["failure"] == "").to_numpy()
            for metric, value_B in measure(rows, draws.weights * chosen_N).items():
                has_state = (state == BOTH) == (metric in OF_BOTH) and (name not in GATES or metric in OF_BOTH)
                if metric == "test_samples" or not has_state or not np.isfinite(value_B[0]):
                    continue
                lead = ("", np.nan, np.nan, np.nan)
                if metric == "auroc_failed":
                    areas = {
                        gate: ranking(score_N, failed_N, draws.weights * has_N)["area"]
                        for gate, score_N in scores.items()
                        if gate != name
                    }
                    best = best_of(areas, areas)
                    lead = best, *interval(value_B - areas[best])
                enough = len(set(cluster_N[has_N])) >= FEWEST_FAMILIES
                drawn_B_n = draws.weights[1:, has_N] if metric.startswith("coverage_") else None
                estimate = interval(value_B, drawn_B_n) if enough else (value_B[0], np.nan, np.nan)
                counted = int((chosen_N if metric == "no_estimate" else has_N).sum())
                records.append((method, state, name, metric, counted, known["seed"].nunique(), *estimate, *lead))
    return records


def of_state(rows: Frame) -> dict[str, np.ndarray]:
    """Which rows (N,) are of each state."""
    failed_N = rows["failed"].to_numpy()
    return {SUCCEEDED: ~failed_N, FAILED: failed_N, BOTH: np.ones(len(rows), bool)}


def measure(rows: Frame, weights_B_N: np.ndarray) -> dict[str, np.ndarray]:
    """Metrics (B,) of results/README.md by weights (B, N), NaN where undefined; spearman_error is unweighted."""
    from scipy.stats import chi2, spearmanr

    has_N = (rows["failure"] == "").to_numpy()
    total_B = weights_B_N.sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        metrics = {"no_estimate": 1 - weights_B_N[:, has_N].sum(axis=1) / total_B, "test_samples": total_B}
    if not weights_B_N[:, has_N].any():
        return metrics
    rows, weights_B_N = rows[has_N], weights_B_N[:, has_N]
    for kind in (*KINDS, TRUTH):
        suffix = "" if kind == TRUTH else f"_{kind}"
        for name in () if kind == TRUTH else (f"kl_rotation_{kind}", f"kl_translation_{kind}"):
            metrics[name] = trimmed_mean(rows[name], weights_B_N)
        metrics[f"nne_{kind}"] = np.sqrt(trimmed_mean(rows["error_ratio" + suffix], weights_B_N))
        metrics[f"nees_{kind}"] = trimmed_mean(rows["mahalanobis" + suffix], weights_B_N) / 6
        within = rows["mahalanobis"] <= chi2.ppf(LEVEL, 6) if kind == TRUTH else rows[f"covered_{kind}"]
        metrics[f"coverage_{kind}"] = trimmed_mean(within.astype(float), weights_B_N, trimmed=0)
    spread_N, error_N = rows["spread"].to_numpy(), rows["add_relative"].to_numpy()
    metrics["auroc_failed"] = ranking(spread_N, rows["failed"].to_numpy(), weights_B_N)["area"]
    metrics["spearman_error"] = np.full(len(weights_B_N), np.nan)
    if len(rows) > 2 and min(len(set(spread_N)), len(set(error_N))) > 1:
        metrics["spearman_error"][0] = spearmanr(spread_N, error_N).statistic
    return metrics


def trimmed_mean(values: Series, weights_B_N: np.ndarray, trimmed: float = TRIMMED) -> np.ndarray:
    """Means (B,) over the middle of the weight, a share left out at either end; NaNs are ignored."""
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


def read_intervals(path: str | Path) -> Frame:
    """Read what :func:`collect_intervals` returned; where there is no rival, the difference is NaN."""
    return csv_file.read_numbers(path, COLUMNS, (*COLUMNS[4:9], *COLUMNS[10:]), optional=(*COLUMNS[7:9], *COLUMNS[10:]))


def collect_estimate_seconds(files: Paths) -> Frame:
    """Estimator, method and the median seconds of files ``…/{source}/estimator_{name}/seed{seed}.csv``."""
    import pandas as pd

    parts = []
    for path in files:
        rows = csv_file.read_csv(path, ("sample", "method", "seconds"))
        seconds = csv_file.numbers(path, rows, "seconds", least=0)
        estimator = source_method_seed(path)[1].removeprefix("estimator_")
        parts.append(rows.assign(seconds=seconds, estimator=estimator))
    return pd.concat(parts).groupby(["estimator", "method"], sort=False)["seconds"].median().reset_index()
