"""The values of a run in place of the printed numbers, from its collected files."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.active_learning.metrics import CENSORED_BY
from gpca.attribution.metrics import mean_interval, read_metrics
from gpca.comparison.clusters import Drawn
from gpca.comparison.published import UNITS, Counterpart, Number
from gpca.model.runtime_file import read_runtime

if TYPE_CHECKING:
    import pandas as pd

RUNTIME = "runtime.csv"


@dataclass(frozen=True)
class Reproduced:
    """A run's value.

    Attributes:
        low, high: bounds of its 95 % interval over the repeats; NaN where there is none.
        n: repeats.
        at_least: it is a lower bound only.
        cluster_low, cluster_high: bounds over objects and seeds (:mod:`gpca.comparison.clusters`); NaN where the run
            keeps no predictions of single samples.
    """

    value: float
    low: float
    high: float
    n: int
    at_least: bool = False
    cluster_low: float = math.nan
    cluster_high: float = math.nan

    def interval(self) -> tuple[float, float]:
        """Return the bounds farthest out of both intervals, NaN where there is neither."""
        lows, highs = (self.low, self.cluster_low), (self.high, self.cluster_high)
        return (
            min((bound for bound in lows if not math.isnan(bound)), default=math.nan),
            max((bound for bound in highs if not math.isnan(bound)), default=math.nan),
        )

    def times(self, factor: float) -> Reproduced:
        """Return the same value in a unit of which it holds `factor` times as many."""
        scaled = ("value", "low", "high", "cluster_low", "cluster_high")
        return replace(self, **{name: factor * getattr(self, name) for name in scaled})


def value_of_run(
    number: Number,
    results: Mapping[str, pd.DataFrame],
    clusters: Mapping[Counterpart, Drawn] | None = None,
) -> Reproduced | None:
    """Return the run's value in place of the number, in its unit; None where it has none.

    Args:
        number: the printed one.
        results: file name -> its rows, as :func:`read_results` reads them.
        clusters: counterpart -> its draws of clusters and seeds (:func:`gpca.comparison.clusters.cluster_draws`).
    """
    counterpart = number.counterpart
    if counterpart is None or counterpart.file not in results:
        return None
    of_file = _of_runtime if counterpart.file == RUNTIME else _of_tidy
    reproduced = of_file(results[counterpart.file], counterpart)
    if reproduced is None:
        return None
    drawn = (clusters or {}).get(counterpart)
    cluster_low, cluster_high = drawn.bounds() if drawn else (math.nan, math.nan)
    unit = UNITS[number.unit]
    reproduced = replace(reproduced, cluster_low=cluster_low, cluster_high=cluster_high).times(unit.factor)
    low, high = (
        bound if math.isnan(bound) else min(max(bound, unit.least), unit.most)
        for bound in (reproduced.low, reproduced.high)
    )
    return replace(reproduced, low=low, high=high)


def read_results(paths: Iterable[str | Path]) -> dict[str, pd.DataFrame]:
    """Read a run's collected files, by name; one that a later step refuses raises its InputError here."""
    return {Path(path).name: (read_runtime if Path(path).name == RUNTIME else read_metrics)(path) for path in paths}


def measured_on(paths: Iterable[str | Path]) -> str:
    """Return the processor that made ``timings.csv``, by its provenance; empty where that is not beside it."""
    sidecars = [Path(f"{path}.provenance.json") for path in paths if Path(path).name == "timings.csv"]
    return next(
        (json.loads(path.read_text(encoding="utf-8"))["device"]["name"] for path in sidecars if path.is_file()), ""
    )


def deviation_interval(deviation: float, n: int) -> tuple[float, float]:
    """Return the 95 % chi-square interval of the standard deviation of n normal repeats."""
    from scipy.stats import chi2

    low, high = (deviation * math.sqrt((n - 1) / chi2.ppf(level, n - 1)) for level in (0.975, 0.025))
    return low, high


def of_seeds(rows: pd.DataFrame, counterpart: Counterpart) -> tuple[pd.Series, bool]:
    """Return the counterpart's values in a tidy file, by seed, and whether some of them are lower bounds."""
    rows = rows[(rows["table"] == counterpart.table) & (rows["concept"] == counterpart.concept)]

    def of_metric(source: str, method: str, metric: str) -> pd.Series:
        chosen = (rows["source"] == source) & (rows["method"] == method) & (rows["metric"] == metric)
        return rows[chosen].set_index("seed")["value"]

    sources, at_least = [], False
    for source in counterpart.sources:
        methods = []
        for method in counterpart.methods:
            value_R, *divisor_R = (of_metric(source, method, metric) for metric in counterpart.metrics)
            methods.append(value_R / divisor_R[0] if divisor_R else value_R)
            if (censoring := CENSORED_BY.get(counterpart.metrics[0])) is not None:
                at_least |= bool((of_metric(source, method, censoring) < 1).any())
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


def _of_tidy(rows: pd.DataFrame, counterpart: Counterpart) -> Reproduced | None:
    """Take the statistic over the seeds; the interval of a deviation is that of its chi-square."""
    by_seed, at_least = of_seeds(rows, counterpart)
    value_R = by_seed.to_numpy()
    if not len(value_R) or np.isnan(value_R).any():
        return None
    n = len(value_R)
    if counterpart.statistic == "deviation":
        if n < 2:
            return None
        deviation = float(value_R.std(ddof=1))
        return Reproduced(deviation, *deviation_interval(deviation, n), n)
    mean, low, high = mean_interval(value_R)
    return Reproduced(mean, math.nan, math.nan, n, True) if at_least else Reproduced(mean, low, high, n)


def _of_runtime(rows: pd.DataFrame, counterpart: Counterpart) -> Reproduced | None:
    """Add up the mean seconds of the components on one device, measured apart from one another."""
    from scipy.stats import t as student_t

    if (measured := runtime_mean(rows, counterpart)) is None:
        return None
    mean, error, n = measured
    if n < 2:
        return Reproduced(mean, math.nan, math.nan, n)
    half_width = float(student_t.ppf(0.975, n - 1) * error)
    return Reproduced(mean, mean - half_width, mean + half_width, n)
