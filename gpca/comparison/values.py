"""The run's value beside each printed number: its interval over seeds, and over clusters of samples and seeds.

Seeds share objects, so their interval does not show how much the choice of objects matters; objects of one family or
scene are alike (:mod:`gpca.objects.canonical`). The bootstrap over clusters needs predictions of single samples, which
a run keeps for shares of samples only.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.active_learning.curves import CENSORED_BY
from gpca.attribution.metrics import PREDICTED_AS
from gpca.attribution.predictions import read_predictions
from gpca.comparison.published import UNITS, Counterpart, Number
from gpca.evaluation.intervals import LEVEL, Clustered, interval, mean_interval, student_factor, weighted_mean
from gpca.evaluation.measures import ALL, read_metrics, source_method_seed
from gpca.evaluation.runtime_file import read_runtime
from gpca.jobs.provenance import read_record

if TYPE_CHECKING:
    import pandas as pd

RUNTIME = "runtime.csv"
FOLDERS = {"metrics.csv": "predictions", "real_world.csv": "predictions", "diagnostics.csv": "learners"}
Folder = tuple[str, str, str]  # e.g. ("predictions", "ycb", "gpca_paper")


@dataclass(frozen=True)
class Reproduced:
    """A run's value."""

    value: float
    low: float  # 95 % interval over the repeats; NaN where there is none
    high: float
    n: int  # repeats
    at_least: bool = False  # the value is a lower bound
    cluster_low: float = math.nan  # 95 % interval over clusters and seeds; NaN without predictions of single samples
    cluster_high: float = math.nan

    def interval(self) -> tuple[float, float]:
        """Return the outermost bounds of both intervals, NaN where there is neither."""
        low, high = np.fmin(self.low, self.cluster_low), np.fmax(self.high, self.cluster_high)
        return float(low), float(high)

    def times(self, factor: float) -> Reproduced:
        """Return the value in a unit that is `factor` times smaller."""
        scaled = ("value", "low", "high", "cluster_low", "cluster_high")
        return replace(self, **{name: factor * getattr(self, name) for name in scaled})


def read_results(paths: Iterable[str | Path]) -> dict[str, pd.DataFrame]:
    """Read a run's collected files, by name."""
    return {Path(path).name: (read_runtime if Path(path).name == RUNTIME else read_metrics)(path) for path in paths}


def measured_on(paths: Iterable[str | Path]) -> str:
    """Return the processor that made ``timings.csv``, by its provenance record; empty without one."""
    records = (read_record(Path(path)) for path in paths if Path(path).name == "timings.csv")
    return next((record["device"]["name"] for record in records if record), "")


def value_of_run(
    number: Number, results: Mapping[str, pd.DataFrame], clusters: Mapping[Counterpart, ShareDraws] | None = None
) -> Reproduced | None:
    """Return the run's value for a printed number, in its unit; None where the run has none."""
    counterpart = number.counterpart
    if counterpart is None or counterpart.file not in results:
        return None
    if counterpart.file == RUNTIME:
        if (timed := runtime_mean(results[RUNTIME], counterpart)) is None:
            return None
        mean, error, n = timed
        half_width = student_factor(n) * error
        reproduced = Reproduced(mean, mean - half_width, mean + half_width, n)
    else:
        by_seed, at_least = values_by_seed(results[counterpart.file], counterpart)
        value_R, n = by_seed.to_numpy(), len(by_seed)
        if not n or np.isnan(value_R).any() or (n < 2 and counterpart.statistic == "deviation"):
            return None
        if counterpart.statistic == "deviation":
            deviation = float(value_R.std(ddof=1))
            reproduced = Reproduced(deviation, *deviation_interval(deviation, n), n)
        else:
            mean, low, high = mean_interval(value_R)
            low, high = (math.nan, math.nan) if at_least else (low, high)
            reproduced = Reproduced(mean, low, high, n, at_least)
    if draws := (clusters or {}).get(counterpart):
        cluster_low, cluster_high = draws.bounds()
        reproduced = replace(reproduced, cluster_low=cluster_low, cluster_high=cluster_high)
    unit = UNITS[number.unit]
    reproduced = reproduced.times(unit.factor)
    low, high = (
        bound if math.isnan(bound) else min(max(bound, unit.least), unit.most)
        for bound in (reproduced.low, reproduced.high)
    )
    return replace(reproduced, low=low, high=high)


def values_by_seed(rows: pd.DataFrame, counterpart: Counterpart) -> tuple[pd.Series, bool]:
    """Return the counterpart's values in a tidy file, by seed, and whether some of them are lower bounds."""
    rows = rows[(rows["table"] == counterpart.table) & (rows["concept"] == counterpart.concept)]

    def by_seed(source: str, method: str, metric: str) -> pd.Series:
        chosen = (rows["source"] == source) & (rows["method"] == method) & (rows["metric"] == metric)
        return rows[chosen].set_index("seed")["value"]

    sources, at_least = [], False
    for source in counterpart.sources:
        methods = []
        for method in counterpart.methods:
            value_R, *divisor_R = (by_seed(source, method, metric) for metric in counterpart.metrics)
            methods.append(value_R / divisor_R[0] if divisor_R else value_R)
            if (censoring := CENSORED_BY.get(counterpart.metrics[0])) is not None:
                at_least |= bool((by_seed(source, method, censoring) < 1).any())
        sources.append(sum(methods[1:], methods[0]))
    return sum(sources[1:], sources[0]) / len(sources), at_least


def runtime_mean(rows: pd.DataFrame, counterpart: Counterpart) -> tuple[float, float, int] | None:
    """Return the sum of the components' mean seconds on one device, its standard error, and the repeats."""
    rows = rows[rows["device"] == counterpart.concept].set_index("component")
    if not set(counterpart.methods) <= set(rows.index):
        return None
    rows = rows.loc[list(counterpart.methods)]
    n = int(rows["repeats"].min())
    return float(rows["mean_s"].sum()), math.sqrt((rows["deviation_s"] ** 2).sum() / n), n


def deviation_interval(deviation: float, n: int) -> tuple[float, float]:
    """Return the 95 % chi-square interval of the standard deviation of n normal repeats."""
    from scipy.stats import chi2

    low, high = (deviation * math.sqrt((n - 1) / chi2.ppf(level, n - 1)) for level in (0.975, 0.025))
    return low, high


def folder_behind(counterpart: Counterpart | None) -> Folder | None:
    """Return the folder of the predictions that a counterpart is a share of; None if it is no share of samples."""
    if counterpart is None or counterpart.statistic != "mean" or counterpart.file not in FOLDERS:
        return None
    confusion = len(counterpart.metrics) == 2 and counterpart.metrics[0].startswith(PREDICTED_AS)
    is_share = confusion or counterpart.metrics == ("accuracy",)
    return (FOLDERS[counterpart.file], counterpart.sources[0], counterpart.methods[0]) if is_share else None


def folders_behind(counterparts: Iterable[Counterpart | None]) -> list[Folder]:
    """Return the folders of all counterparts, each once."""
    return sorted({folder for counterpart in counterparts if (folder := folder_behind(counterpart))})


@dataclass(frozen=True)
class ShareDraws:
    """A share of samples in every bootstrap draw of clusters and seeds; shares of one source have common draws."""

    share_B: np.ndarray  # (1 + B,) in [0, 1], of the samples themselves first; NaN in a draw without any sample
    samples: Clustered  # all of the folder
    mask_N: np.ndarray  # the samples that the share counts

    def bounds(self, level: float = LEVEL, minus: ShareDraws | None = None) -> tuple[float, float]:
        """Return the bounds of the share, or of its difference from another, draw by draw."""
        share_B = self.share_B - minus.share_B if minus else self.share_B
        return interval(share_B, self.samples.weights[1:, self.mask_N], difference=minus is not None, level=level)[1:]


def cluster_draws(
    counterparts: Iterable[Counterpart | None], prediction_files: Iterable[str | Path]
) -> dict[Counterpart, ShareDraws]:
    """Return the shares by the pigeonhole bootstrap over clusters and seeds.

    Counterparts that are no shares of samples, or whose folder has no file, are left out. Files of predictions are
    named ``…/{predictions or learners}/{source}/{method}/seed{seed}.csv``.
    """
    import pandas as pd

    parts: dict[Folder, list[pd.DataFrame]] = defaultdict(list)
    asked = {each: folder for each in counterparts if each and (folder := folder_behind(each))}
    for path in prediction_files:
        source, method, seed = source_method_seed(path)
        folder = (Path(path).parts[-4], source, method)
        if folder in asked.values():
            rows = read_predictions(path, ("set",) if folder[0] == "learners" else ())
            parts[folder].append(rows[rows["split"] == "test"].assign(seed=seed))
    tables = {folder: pd.concat(frames, ignore_index=True) for folder, frames in parts.items()}
    samples = {
        folder: Clustered.drawn(rows["seed"], rows["cluster"], "printed", folder[1]) for folder, rows in tables.items()
    }
    draws = {}
    for counterpart, folder in asked.items():
        if (rows := tables.get(folder)) is None:
            continue
        mask = (rows["concept_true"] == counterpart.concept) | (counterpart.concept == ALL)
        if "set" in rows:
            mask &= rows["set"] == counterpart.table.partition("/")[2]
        target, metric = rows["concept_true"], counterpart.metrics[0]
        if metric.startswith(PREDICTED_AS):
            target = metric.removeprefix(PREDICTED_AS)
        hit_N, mask_N = ((rows["concept_predicted"] == target) & ~rows["abstained"]).to_numpy(float), mask.to_numpy()
        share_B = weighted_mean(hit_N[mask_N], samples[folder].weights[:, mask_N])
        draws[counterpart] = ShareDraws(share_B, samples[folder], mask_N)
    return draws
