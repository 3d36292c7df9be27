"""Measures of test samples by seed, and over all seeds with intervals and paired differences: one form of rows.

Samples are a frame with one row each; ``cluster`` is the family, scene or table. A file of numbers holds either one
value per seed (`TIDY_COLUMNS`) or one row over all seeds with its interval (`COLUMNS`). A difference is a row of the
latter kind: ``against`` says what kind of rival it is measured from, ``other`` which one.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.evaluation.intervals import ANYTHING, Clustered, best_of, corrected, interval, weighted_mean
from gpca.io.csv_file import read_numbers, write_csv
from gpca.io.frame import Frame
from gpca.seeds import seed_of_file

ALL = "all"  # the part of the samples, or the concept, that comprises all of them
POOLED = "pooled"  # the source that comprises all of them
GROUPS = ("table", "source", "method")
KEYS = (*GROUPS, "metric", "concept")
TIDY_COLUMNS = (*KEYS, "seed", "value")
AGAINST = ("against", "other")
PICKED = ("rival", "trivial", "trained")  # kinds of differences, from the best of several
NUMBERS = ("seeds", "clusters", "samples", "value", "low", "high")
COLUMNS = (*KEYS, *NUMBERS)
TEST_SAMPLES = "test_samples"
SHARE = None  # limits of a share of samples
Parts = Mapping[str, np.ndarray]  # name -> mask of the samples (N,)
Rivals = Callable[[str, Collection[str]], Collection[str]]  # of a method, among the methods with a value


@dataclass(frozen=True)
class Measure:
    """A statistic of samples, by default the mean of a column or of a function of the samples."""

    of: str | Callable[[Frame], np.ndarray] = ""  # column, or function that returns a value per sample (N,)
    limits: tuple[float, float] | None = SHARE  # least and greatest value; a share of samples has its own interval
    only: tuple[str, ...] = ()  # parts of the samples that it is taken over; all if empty
    statistic: Callable[[Frame, np.ndarray], np.ndarray] | None = None  # of samples and weights (1 + B, N)
    counted: Callable[[Frame], np.ndarray] | None = None  # mask of the samples that it depends on (N,)
    least_is_best: bool = False  # of two values, the smaller one is better
    factor: float = 1.0  # from the mean to the measure's unit

    def values(self, samples: Frame, weights_B_N: np.ndarray) -> np.ndarray:
        """Values (B,) by weights of the samples."""
        if self.statistic is not None:
            return self.statistic(samples, weights_B_N)
        value_N = samples[self.of] if isinstance(self.of, str) else self.of(samples)
        return weighted_mean(value_N, weights_B_N) * self.factor


def by_value(samples: Frame, column: str, values: Iterable[str]) -> dict[str, np.ndarray]:
    """Masks of all samples, and of those with each value in a column."""
    masks = {value: (samples[column] == value).to_numpy() for value in values}
    return {ALL: np.ones(len(samples), bool)} | masks


COUNT = Measure(statistic=lambda _samples, weights_B_N: weights_B_N.sum(axis=1), limits=ANYTHING)  # of samples


def read_samples(
    files: Iterable[str | Path], read: Callable[[Path], Frame], names: tuple[str, ...] = ("source", "method")
) -> Frame:
    """Rows of files named ``…/{source}/{method}/seed{seed}.csv``, with these three as columns."""
    import pandas as pd

    frames = []
    for path in files:
        *folders, seed = source_method_seed(path)
        frames.append(read(Path(path)).assign(**dict(zip(names, folders[-len(names) :], strict=True)), seed=seed))
    if not frames:
        raise InputError("samples", "no files were given", "run their step first")
    return pd.concat(frames, ignore_index=True)


def per_seed(samples: Frame, parts: Callable[[Frame], Parts], measures: Mapping[str, Measure]) -> Frame:
    """`TIDY_COLUMNS` of each measure by table, source, method, seed and part, and the number of ``test_samples``."""
    records = []
    for (*keys, seed), rows in samples.groupby([*GROUPS, "seed"], sort=False):
        for part, mask_N in parts(rows).items():
            subset = rows[mask_N]
            for name, measure in _taken(part, measures) if len(subset) else ():
                if np.isfinite(value := measure.values(subset, np.ones((1, len(subset))))[0]):
                    records.append((*keys, name, part, seed, float(value)))
            if len(subset) and TEST_SAMPLES not in measures:
                records.append((*keys, TEST_SAMPLES, part, seed, float(len(subset))))
    return tidy(records, "samples")


def over_seeds(
    samples: Frame, parts: Callable[[Frame], Parts], measures: Mapping[str, Measure], draws: Clustered
) -> Frame:
    """`COLUMNS` of each measure by table, source, method and part, over all seeds; an index selects draws."""
    import pandas as pd

    records = []
    for keys, rows in samples.groupby(list(GROUPS), sort=False):
        for part, mask_N in parts(rows).items():
            subset, drawn = rows[mask_N], draws.subset(rows.index.to_numpy()[mask_N])
            for name, measure in _taken(part, measures) if len(subset) else ():
                value_B = measure.values(subset, drawn.weights)
                if measure.limits is None:  # a share
                    estimate = interval(value_B, drawn.weights[1:])
                else:
                    estimate = drawn.estimate(value_B, measure.limits)
                records.append(drawn.record((*keys, name, part), estimate))
    return pd.DataFrame(records, columns=list(COLUMNS))


def compared(
    keys: tuple[str, str],
    metric: str,
    part: str,
    values: Mapping[str, np.ndarray],
    draws: Clustered,
    limits: tuple[float, float] | None = ANYTHING,
    against: Mapping[str, Rivals] | None = None,
    least_is_best: bool = False,
) -> list[tuple]:
    """Rows of `KEYS`, `AGAINST` and `NUMBERS`: a measure of several methods on the same samples, and differences.

    `keys` are table and source; `values` are those (1 + B,) of the samples and of every draw, NaN where a method has
    none. A difference is from the best of the rivals of a kind.
    """
    values = {method: value_B for method, value_B in values.items() if np.isfinite(value_B[0])}
    drawn_B_N = draws.weights[1:] if limits is SHARE else None
    rows = []
    for method, value_B in values.items():
        names = (*keys, method, metric, part)
        value, *bounds = interval(value_B, drawn_B_N, samples=draws.independent)
        if limits is not SHARE:
            bounds = np.clip(bounds, *limits).tolist()
        rows.append((*names, "", "", *draws.counts, value, *bounds))
        for kind, rivals in (against or {}).items():
            others = sorted(other for other in rivals(method, values) if other != method)
            if other := best_of(values, others, least_is_best):
                apart = interval(value_B - values[other], drawn_B_N, difference=True)
                rows.append((*names, kind, other, *draws.counts, *apart))
    return rows


def intervals(records: list[tuple], name: str, most: float = np.inf) -> Frame:
    """Frame of `COLUMNS`, or of `KEYS`, `AGAINST` and `NUMBERS`; `name` says what the records are of.

    Differences have :func:`corrected <gpca.evaluation.intervals.corrected>` bounds: those from the best of several
    methods, a kind in `PICKED`, for all methods that have one. `most` is the largest difference that there can be,
    where the records do not hold the measures themselves.
    """
    with_rivals = bool(records) and len(records[0]) > len(COLUMNS)
    rows = tidy(records, name, (*KEYS, *AGAINST, *NUMBERS) if with_rivals else COLUMNS, "run its step first")
    if with_rivals:
        keys = [*(key for key in KEYS if key != "method"), AGAINST[0]]
        measured = rows[rows[AGAINST[0]] == ""].groupby(keys[:-1], sort=False)
        reach = (measured["high"].max() - measured["low"].min()).dropna().to_dict()
        methods = measured["method"].agg(set).to_dict()
        for (*place, kind), of in rows[rows[AGAINST[0]] != ""].groupby(keys, sort=False):
            value_M, low_M, high_M, clusters_M = (of[name].to_numpy() for name in ("value", "low", "high", "clusters"))
            beside = set(of["other"]) <= methods.get(tuple(place), set())  # else it was measured in another place
            farthest = reach.get(tuple(place), most) if beside else most
            bounds = corrected(value_M, low_M, high_M, clusters_M, kind in PICKED, farthest)
            rows.loc[of.index, ["low", "high"]] = np.column_stack(bounds)
    return rows


def read_clustered(path: str | Path) -> Frame:
    """Read a file of intervals; a value without one has NaN bounds, a row that is no difference no ``against``."""
    rows = read_numbers(path, COLUMNS, NUMBERS, optional=("low", "high"), others=AGAINST)
    return rows.assign(**{name: "" for name in AGAINST if name not in rows})


def read_rows(path: str | Path) -> Frame:
    """Read a file of numbers of either form: :func:`read_clustered` or :func:`read_metrics`."""
    with Path(path).open(encoding="utf-8", errors="replace") as file:
        head = file.readline().strip().split(",")
    return read_clustered(path) if "low" in head else read_metrics(path)


def read_metrics(path: str | Path) -> Frame:
    return read_numbers(path, TIDY_COLUMNS, ("seed", "value")).astype({"seed": int})


def read_all_metrics(paths: Iterable[str | Path]) -> Frame:
    """Read several files as :func:`read_metrics` reads one, one after the other."""
    import pandas as pd

    return pd.concat([read_metrics(path) for path in paths])


def write_metrics(metrics: Frame, path: str | Path) -> None:
    """Write numbers as CSV; floats keep every digit, so equal numbers give equal bytes."""
    write_csv(path, metrics, form=None)


def tidy(
    records: list[tuple],
    name: str,
    columns: Sequence[str] = TIDY_COLUMNS,
    remedy: str = "name at least one explainer in the config",
) -> Frame:
    """Frame of `TIDY_COLUMNS`; `name` says what the records are of."""
    import pandas as pd

    if not records:
        raise InputError(name, "no files were given", remedy)
    return pd.DataFrame(records, columns=list(columns))


def source_method_seed(path: str | Path) -> tuple[str, str, int]:
    """Source, method and seed of a file named ``…/{source}/{method}/seed{seed}.csv``."""
    seed, parts = seed_of_file(path), Path(path).parts
    if len(parts) < 3:
        raise InputError(path, "is not named …/{source}/{explainer}/seed{number}.csv", "rename it")
    return parts[-3], parts[-2], seed


def _taken(part: str, measures: Mapping[str, Measure]) -> list[tuple[str, Measure]]:
    return [(name, measure) for name, measure in measures.items() if not measure.only or part in measure.only]
