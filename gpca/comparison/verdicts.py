"""What the paper prints beside what a run reproduced, with a verdict on each number (docs/comparison.md)."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.active_learning.metrics import CENSORED_BY
from gpca.attribution.metrics import mean_interval, read_metrics
from gpca.comparison.published import TIMES, UNITS, Counterpart, Number
from gpca.comparison.reasons import Reason, reason_of
from gpca.errors import InputError
from gpca.model.runtime_file import read_runtime
from gpca.objects.title import STAND_IN, title_of
from gpca.settings import NotNegative

if TYPE_CHECKING:
    import pandas as pd

REPRODUCED, CLOSE, NOT_REPRODUCED = "reproduced", "close", "not reproduced"
NOT_COMPARABLE, NOT_RUN = "not comparable", "not run"
VERDICTS = (REPRODUCED, CLOSE, NOT_REPRODUCED, NOT_COMPARABLE, NOT_RUN)
COMPARISON_COLUMNS = (
    *("table", "row", "column", "unit", "published", "upper", "deviation", "decimals"),
    *("reproduced", "ci_low", "ci_high", "n", "at_least", "difference", "factor"),
    *("verdict", "reason", "objects", "hardware"),
)
RUNTIME = "runtime.csv"


@dataclass(frozen=True)
class Tolerance:
    """Distances up to which a number counts as reproduced and as close, in its unit or, with `factor`, as a ratio."""

    reproduced: NotNegative
    close: NotNegative
    factor: bool = False

    def __post_init__(self):
        if not (1 if self.factor else 0) <= self.reproduced <= self.close:
            least = "1 <= reproduced <= close" if self.factor else "0 <= reproduced <= close"
            raise InputError("tolerance", f"{self.reproduced:g} and {self.close:g}", f"it has to be {least}")


@dataclass(frozen=True)
class Reproduced:
    """A run's value, the bounds of its 95 % interval (NaN where there is none), repeats; perhaps a lower bound only."""

    value: float
    low: float
    high: float
    n: int
    at_least: bool = False


def compare(
    numbers: Sequence[Number],
    results: Mapping[str, pd.DataFrame],
    objects: Mapping[str, Mapping],
    tolerances: Mapping[str, Tolerance],
    reasons: Sequence[Reason],
    hardware: str = "",
) -> pd.DataFrame:
    """Return `COMPARISON_COLUMNS`, a row per printed number, in its unit.

    Args:
        numbers: printed ones.
        results: file name -> its rows, as :func:`read_results` reads them.
        objects: source -> ``{"title": str, "stand_in": bool}``; "model" is what the explained model was trained on.
        tolerances: one for each unit.
        reasons: why printed numbers were not reached.
        hardware: what times were measured on, where their file does not say.

    Raises:
        InputError: a unit without tolerance.
    """
    import pandas as pd

    deviations: dict[Counterpart | None, Number] = {
        n.counterpart: n for n in numbers if n.counterpart and n.counterpart.statistic == "deviation"
    }
    records = []
    for number in numbers:
        if number.unit not in tolerances:
            raise InputError("config key comparison.tolerances", f"no unit '{number.unit}'", "give its tolerance")
        deviation = deviations.get(_deviation_of(number.counterpart))
        found = value_of_run(number, results)
        tolerance = tolerances[number.unit]
        spread = deviation.value if deviation else 0.0
        verdict, reason = _judge(number, found, spread, objects, tolerance, reasons)
        records.append(
            {
                **dict(zip(("table", "row", "column"), number.key, strict=True)),
                "unit": number.unit,
                "published": number.value,
                "upper": number.upper if number.upper > number.value else np.nan,
                "deviation": deviation.value if deviation else np.nan,
                "decimals": number.decimals,
                **_columns(number, found, tolerance),
                "verdict": verdict,
                "reason": reason,
                "objects": _objects(number.counterpart, objects),
                "hardware": _hardware(number, results, hardware),
            }
        )
    return pd.DataFrame(records, columns=list(COMPARISON_COLUMNS)).astype({"n": "Int64"})


def verdict_of(number: Number, found: Reproduced, tolerance: Tolerance, deviation: float = 0.0) -> str | None:
    """Return reproduced, close or not reproduced; None of a lower bound that tells neither.

    The printed number is a band: from half its last digit, and its printed standard deviation, below to as much above.
    What a run has is reproduced where it lies in the band or within `tolerance.reproduced` of it, or where its 95 %
    interval meets the band and is no wider than `tolerance.close` to either side. It is close within
    `tolerance.close`, or where a wider interval meets the band.
    """
    scale = _log if tolerance.factor else float
    near, far = (scale(bound) for bound in (tolerance.reproduced, tolerance.close))
    margin = number.rounding + deviation
    least, most = scale(number.value - margin), scale(number.upper + margin)
    value = scale(found.value)
    low = scale(found.low)
    high = scale(found.high)
    distance = max(0.0, least - value, value - most)
    if found.at_least:
        return NOT_REPRODUCED if value - most > far else None
    meets = low <= most and high >= least  # False of NaN
    half_width = high - value if tolerance.factor else max(high - value, value - low)
    if distance <= near or (meets and half_width <= far):
        return REPRODUCED
    return CLOSE if distance <= far or meets else NOT_REPRODUCED


def value_of_run(number: Number, results: Mapping[str, pd.DataFrame]) -> Reproduced | None:
    """Return what the run has in place of the number, in its unit; None where it has nothing."""
    counterpart = number.counterpart
    if counterpart is None or counterpart.file not in results:
        return None
    of_file = _of_runtime if counterpart.file == RUNTIME else _of_tidy
    found = of_file(results[counterpart.file], counterpart)
    if found is None:
        return None
    unit = UNITS[number.unit]
    value, low, high = (unit.factor * bound for bound in (found.value, found.low, found.high))
    low, high = (bound if math.isnan(bound) else min(max(bound, unit.least), unit.most) for bound in (low, high))
    return Reproduced(value, low, high, found.n, found.at_least)


def read_results(paths: Iterable[str | Path]) -> dict[str, pd.DataFrame]:
    """Read a run's collected files, by name; one that a later step refuses raises its InputError here."""
    return {Path(path).name: (read_runtime if Path(path).name == RUNTIME else read_metrics)(path) for path in paths}


def measured_on(paths: Iterable[str | Path]) -> str:
    """Return the processor that made ``timings.csv``, by its provenance; empty where that is not beside it."""
    sidecars = [Path(f"{path}.provenance.json") for path in paths if Path(path).name == "timings.csv"]
    return next(
        (json.loads(path.read_text(encoding="utf-8"))["device"]["name"] for path in sidecars if path.is_file()), ""
    )


def counts(comparison: pd.DataFrame) -> dict[str, int]:
    """Return verdict -> how many numbers have it."""
    return {verdict: int((comparison["verdict"] == verdict).sum()) for verdict in VERDICTS}


def _judge(number, found, deviation, objects, tolerance, reasons) -> tuple[str, str]:
    if number.counterpart is None:
        return NOT_COMPARABLE, number.note
    if any(objects[source]["stand_in"] for source in number.counterpart.sources if source in objects):
        return NOT_COMPARABLE, STAND_IN
    if found is None:
        return NOT_RUN, f"{number.counterpart.file} holds no such value"
    verdict = verdict_of(number, found, tolerance, deviation)
    if verdict is None:
        return NOT_COMPARABLE, "some repeats ended before they were done, so the mean is a lower bound"
    return verdict, "" if verdict == REPRODUCED else reason_of(number, reasons)


def _columns(number: Number, found: Reproduced | None, tolerance: Tolerance) -> dict[str, object]:
    """Return the reproduced value, and how far it is from the nearest end of what is printed."""
    import pandas as pd

    if found is None:
        return {"n": pd.NA, "at_least": False}
    printed = min(max(found.value, number.value), number.upper)
    return {
        "reproduced": round(found.value, 6),
        "ci_low": round(found.low, 6),
        "ci_high": round(found.high, 6),
        "n": found.n,
        "at_least": found.at_least,
        "difference": round(found.value - printed, 6),
        "factor": round(found.value / printed, 6) if tolerance.factor else np.nan,
    }


def _of_tidy(rows: pd.DataFrame, counterpart: Counterpart) -> Reproduced | None:
    """Take the statistic over the seeds of what the counterpart names in a tidy file; of a deviation, by chi-square."""
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
    value_R = (sum(sources[1:], sources[0]) / len(sources)).to_numpy()
    if not len(value_R) or np.isnan(value_R).any():
        return None
    n = len(value_R)
    if counterpart.statistic == "deviation":
        return _deviation(value_R) if n > 1 else None
    mean, low, high = mean_interval(value_R)
    return Reproduced(mean, math.nan, math.nan, n, True) if at_least else Reproduced(mean, low, high, n)


def _deviation(value_R: np.ndarray) -> Reproduced:
    from scipy.stats import chi2

    n = len(value_R)
    deviation = float(value_R.std(ddof=1))
    low, high = (deviation * math.sqrt((n - 1) / chi2.ppf(level, n - 1)) for level in (0.975, 0.025))
    return Reproduced(deviation, low, high, n)


def _of_runtime(rows: pd.DataFrame, counterpart: Counterpart) -> Reproduced | None:
    """Add up the mean seconds of the components on one device, measured apart from one another."""
    from scipy.stats import t as student_t

    rows = rows[rows["device"] == counterpart.concept].set_index("component")
    if not set(counterpart.methods) <= set(rows.index):
        return None
    rows = rows.loc[list(counterpart.methods)]
    n = int(rows["repeats"].min())
    mean = float(rows["mean_s"].sum())
    if n < 2:
        return Reproduced(mean, math.nan, math.nan, n)
    half_width = float(student_t.ppf(0.975, n - 1) * math.sqrt((rows["deviation_s"] ** 2).sum() / n))
    return Reproduced(mean, mean - half_width, mean + half_width, n)


def _objects(counterpart: Counterpart | None, objects: Mapping[str, Mapping]) -> str:
    sources = counterpart.sources if counterpart else ()
    return ", ".join(title_of(objects[source]) for source in sources if source in objects)


def _hardware(number: Number, results: Mapping[str, pd.DataFrame], hardware: str) -> str:
    """Say on what a time was measured; empty of all else."""
    counterpart = number.counterpart
    if counterpart is None or counterpart.file not in results or number.unit not in TIMES:
        return ""
    if counterpart.file != RUNTIME:
        return hardware
    rows = results[RUNTIME]
    return ", ".join(rows.loc[rows["device"] == counterpart.concept, "hardware"].unique())


def _deviation_of(counterpart: Counterpart | None) -> Counterpart | None:
    from dataclasses import replace

    return replace(counterpart, statistic="deviation") if counterpart and counterpart.statistic == "mean" else None


def _log(value: float) -> float:
    return math.log(value) if value > 0 else value if math.isnan(value) else -math.inf
