"""The run's value beside each printed number: its interval over seeds and samples, and over clusters of samples."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from gpca.active_learning.curves import CENSORED_BY
from gpca.attribution.metrics import PREDICTED_AS
from gpca.attribution.predictions import read_predictions
from gpca.comparison.published import UNITS, Counterpart, Number, Unit
from gpca.evaluation.intervals import (
    LEVEL,
    NO_WIDTH,
    Clustered,
    interval,
    student_factor,
    weighted_mean,
    wilson_interval,
)
from gpca.evaluation.measures import ALL, read_metrics, source_method_seed
from gpca.evaluation.runtime_file import read_runtime
from gpca.io.frame import Frame, Series
from gpca.jobs.provenance import read_record

RUNTIME = "runtime.csv"
FOLDERS = {"metrics.csv": "predictions", "real_world.csv": "predictions", "diagnostics.csv": "learners"}
Folder = tuple[str, str, str]  # e.g. ("predictions", "ycb", "gpca_paper")


@dataclass(frozen=True)
class Reproduced:
    """A run's value, in the unit of the printed one."""

    value: float
    low: float  # 95 % interval over the repeats and their samples, with the objects fixed; NaN where there is none
    high: float
    n: int  # repeats
    at_least: bool = False  # the value is a lower bound
    cluster_low: float = math.nan  # 95 % interval over clusters and seeds; NaN without predictions of single samples
    cluster_high: float = math.nan
    deviation: float = math.nan  # of the repeats of a mean
    samples: float = 0.0  # of a share, in each repeat; 0 where predictions are not kept

    def over_objects(self) -> Reproduced:
        """Return it with the farther bounds of both intervals."""
        low, high = np.fmin(self.low, self.cluster_low), np.fmax(self.high, self.cluster_high)
        return replace(self, low=float(low), high=float(high))

    def repeated(self, n: int, unit: Unit) -> Reproduced:
        """Return it as after `n` repeats with the same mean and deviation."""
        low, high = mean_bounds(self.value, self.deviation, n, unit, round(self.samples * n))
        return replace(self, n=n, low=low, high=high)


def mean_bounds(mean: float, deviation: float, n: int, unit: Unit, samples: int = 0) -> tuple[float, float]:
    """Return the 95 % interval of a mean of n repeats: Student's, of a ratio on its logarithm; NaN for one repeat.

    Where it has no width or passes what is possible, a share of samples has the farther bounds of it and of Wilson's.
    """
    half_width = student_factor(n) * deviation / math.sqrt(n)
    if unit.ratio and mean > 0:
        factor = math.exp(half_width / mean)
        low, high = mean / factor, mean * factor
    else:
        low, high = mean - half_width, mean + half_width
        if samples and (half_width <= NO_WIDTH or low < unit.least or high > unit.most):
            least, most = (unit.most * bound for bound in wilson_interval(mean / unit.most * samples, samples))
            low, high = min(low, least), max(high, most)
    return min(max(low, unit.least), unit.most), min(max(high, unit.least), unit.most)


def read_results(paths: Iterable[str | Path]) -> dict[str, Frame]:
    return {Path(path).name: (read_runtime if Path(path).name == RUNTIME else read_metrics)(path) for path in paths}


def measured_on(paths: Iterable[str | Path]) -> str:
    """Return the processor that made ``timings.csv``, by its provenance record; empty without one."""
    records = (read_record(Path(path)) for path in paths if Path(path).name == "timings.csv")
    return next((record["device"]["name"] for record in records if record), "")


def value_of_run(
    number: Number, results: Mapping[str, Frame], clusters: Mapping[Counterpart, ShareDraws] | None = None
) -> Reproduced | None:
    """Return the run's value for a printed number, in its unit; None where the run has none."""
    counterpart, unit, at_least = number.counterpart, UNITS[number.unit], False
    if counterpart is None or counterpart.file not in results:
        return None
    draws = (clusters or {}).get(counterpart)
    if counterpart.file == RUNTIME:
        if (timed := runtime_mean(results[RUNTIME], counterpart)) is None:
            return None
        mean, error, n = timed
        deviation = error * math.sqrt(n)
    else:
        by_seed, at_least = values_by_seed(results[counterpart.file], counterpart)
        value_R, n = by_seed.to_numpy(), len(by_seed)
        if not n or np.isnan(value_R).any() or (n < 2 and counterpart.statistic == "deviation"):
            return None
        mean, deviation = float(value_R.mean()), float(value_R.std(ddof=1)) if n > 1 else math.nan
    mean, deviation = unit.factor * mean, unit.factor * deviation
    if counterpart.statistic == "deviation":
        return Reproduced(deviation, *deviation_interval(deviation, n), n)
    samples = int(draws.mask_N.sum()) if draws else 0
    low, high = (math.nan, math.nan) if at_least else mean_bounds(mean, deviation, n, unit, samples)
    cluster_low, cluster_high = draws.bounds() if draws else (math.nan, math.nan)
    around = (unit.factor * cluster_low, unit.factor * cluster_high)
    return Reproduced(mean, low, high, n, at_least, *around, deviation, samples / n)


def values_by_seed(rows: Frame, counterpart: Counterpart) -> tuple[Series, bool]:
    """Return the counterpart's values in a tidy file, by seed, and whether some of them are lower bounds."""
    rows = rows[(rows["table"] == counterpart.table) & (rows["concept"] == counterpart.concept)]

    def by_seed(source: str, method: str, metric: str) -> Series:
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


def runtime_mean(rows: Frame, counterpart: Counterpart) -> tuple[float, float, int] | None:
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
    """Return the shares by the pigeonhole bootstrap over clusters and seeds."""
    import pandas as pd

    parts: dict[Folder, list[Frame]] = defaultdict(list)
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
