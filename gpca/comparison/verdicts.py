"""The printed numbers beside those of a run, with a verdict on each (docs/comparison.md)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gpca.comparison.citations import filled
from gpca.comparison.clusters import Drawn
from gpca.comparison.published import TIMES, Counterpart, Number, Reason, reason_of
from gpca.comparison.values import RUNTIME, Reproduced, deviation_interval, value_of_run
from gpca.errors import InputError
from gpca.objects.entry import STAND_IN, title_of
from gpca.settings import NotNegative

if TYPE_CHECKING:
    import pandas as pd

REPRODUCED, CLOSE, INCONCLUSIVE, NOT_REPRODUCED = "reproduced", "close", "inconclusive", "not reproduced"
NOT_COMPARABLE, NOT_RUN = "not comparable", "not run"
JUDGED = (REPRODUCED, CLOSE, INCONCLUSIVE, NOT_REPRODUCED)
VERDICTS = (*JUDGED, NOT_COMPARABLE, NOT_RUN)
TOO_WIDE = "too wide an interval: it reaches farther than what is close, and does not exclude it"
ONE_REPEAT = "one repeat, so no interval"
LOWER_BOUND = "some repeats ended before they were done, so the mean is a lower bound"
COMPARISON_COLUMNS = (
    *("table", "row", "column", "statistic", "unit", "published", "upper", "decimals"),
    *("paper_low", "paper_high", "deviation", "reproduced", "ci_low", "ci_high", "cluster_low", "cluster_high"),
    *("n", "at_least", "difference", "factor", "verdict", "repeat_of", "reason", "objects", "hardware"),
)


@dataclass(frozen=True)
class Tolerance:
    """Distances up to which a number counts as reproduced and as close, in its unit or, with `factor`, as a ratio."""

    reproduced: NotNegative
    close: NotNegative
    factor: bool = False

    def __post_init__(self):
        if not (1 if self.factor else 0) <= self.reproduced <= self.close:
            least = "1 <= reproduced <= close" if self.factor else "0 <= reproduced <= close"
            raise InputError("tolerance", f"{self.reproduced:g} and {self.close:g}", f"must satisfy {least}")


@dataclass(frozen=True)
class Printed:
    """A printed number, or the range from `value` to `upper`.

    Attributes:
        rounding: half of its last digit.
        low, high: bounds of its 95 % interval; `value` and `upper` where its sampling error cannot be told.
    """

    value: float
    upper: float
    rounding: float
    low: float
    high: float


def compare(
    numbers: Sequence[Number],
    results: Mapping[str, pd.DataFrame],
    objects: Mapping[str, Mapping],
    tolerances: Mapping[str, Tolerance],
    reasons: Sequence[Reason],
    hardware: str = "",
    clusters: Mapping[Counterpart, Drawn] | None = None,
) -> pd.DataFrame:
    """Return `COMPARISON_COLUMNS`, a row per printed number, in its unit.

    Args:
        numbers: the printed numbers.
        results: file name -> its rows, as :func:`gpca.comparison.values.read_results` reads them; those that reasons
            cite too.
        objects: source -> ``{"title": str, "stand_in": bool}``; "model" is what the explained model was trained on.
        tolerances: one for each unit.
        reasons: why printed numbers were not reached.
        hardware: the machine of the measured times, where their file does not say.
        clusters: counterpart -> its draws of clusters and seeds (:func:`gpca.comparison.clusters.cluster_draws`).

    Raises:
        InputError: a unit without tolerance.
    """
    import pandas as pd

    deviations = {n.key[:2]: n for n in numbers if n.counterpart and n.counterpart.statistic == "deviation"}
    records: list[dict] = []
    values: dict[tuple[str, ...], Reproduced | None] = {}
    for number in numbers:
        if number.unit not in tolerances:
            raise InputError("config key comparison.tolerances", f"has no unit '{number.unit}'", "add its tolerance")
        deviation = _deviation_of(number, deviations)
        printed = printed_of(number, deviation)
        reproduced = values[number.key] = value_of_run(number, results, clusters)
        tolerance = tolerances[number.unit]
        verdict, reason = _judge(number, printed, reproduced, objects, tolerance, reasons)
        reason = filled(reason, number, results)
        first = values.get(number.same_as)
        repeats = (
            first is not None and reproduced is not None and (first.value, first.n) == (reproduced.value, reproduced.n)
        )
        records.append(
            {
                **dict(zip(("table", "row", "column"), number.key, strict=True)),
                "statistic": number.counterpart.statistic if number.counterpart else "mean",
                "unit": number.unit,
                "published": number.value,
                "upper": number.upper if number.upper > number.value else np.nan,
                "decimals": number.decimals,
                **_sampling(printed),
                "deviation": deviation.value if deviation else np.nan,
                **_columns(number, reproduced, tolerance),
                "verdict": verdict,
                "repeat_of": " / ".join(number.same_as) if repeats else "",
                "reason": reason,
                "objects": _objects(number.counterpart, objects),
                "hardware": _hardware(number, results, hardware),
            }
        )
    return pd.DataFrame(records, columns=list(COMPARISON_COLUMNS)).astype({"n": "Int64"})


def printed_of(number: Number, deviation: Number | None = None) -> Printed:
    """Return the number with the interval that its sampling leaves.

    A share of n samples has Wilson's interval, a standard deviation of n repeats that of its chi-square, a mean whose
    standard deviation is printed Student's.

    Args:
        number: the printed one.
        deviation: the printed standard deviation of the same repeats.
    """
    low, high = number.value, number.upper
    if number.counterpart and number.counterpart.statistic == "deviation" and number.paper_n > 1:
        low, high = deviation_interval(number.value, number.paper_n)
    elif deviation and deviation.paper_n > 1:
        from scipy.stats import t as student_t

        half_width = student_t.ppf(0.975, deviation.paper_n - 1) * deviation.value / math.sqrt(deviation.paper_n)
        low, high = number.value - half_width, number.upper + half_width
    elif number.unit == "%" and number.paper_n:
        from scipy.stats import binomtest

        right = round(number.value / 100 * number.paper_n)
        interval = binomtest(right, number.paper_n).proportion_ci(method="wilson")
        # What is printed is rounded, and lies in its own interval nevertheless.
        low, high = min(100 * interval.low, number.value), max(100 * interval.high, number.value)
    return Printed(number.value, number.upper, number.rounding, float(low), float(high))


def verdict_of(printed: Printed, reproduced: Reproduced, tolerance: Tolerance) -> str:
    """Return one of `JUDGED`.

    The printed number is a band, half its last digit to either side. The difference of the run's value from the band
    has an interval, of both samplings (Newcombe's square-and-add). Where that reaches farther from the difference than
    `tolerance.close`, nothing can be said but that the number is not reproduced, if the whole interval lies beyond
    `tolerance.close`. Else the number is reproduced where the difference is within `tolerance.reproduced` or its
    interval holds 0, and close where it is within `tolerance.close`.
    """
    scale = _log if tolerance.factor else float
    near, far = (scale(bound) for bound in (tolerance.reproduced, tolerance.close))
    least, most = scale(printed.value - printed.rounding), scale(printed.upper + printed.rounding)
    value = scale(reproduced.value)
    if reproduced.at_least:
        return NOT_REPRODUCED if value - most > far else INCONCLUSIVE
    apart = _apart(value, min(max(value, least), most))
    found_low, found_high = (scale(bound) for bound in reproduced.interval())
    below = math.hypot(_apart(value, found_low), _apart(scale(printed.high), scale(printed.upper)))
    above = math.hypot(_apart(found_high, value), _apart(scale(printed.value), scale(printed.low)))
    low, high = apart - below, apart + above
    if not max(below, above) <= far:  # NaN too
        return NOT_REPRODUCED if low > far or high < -far else INCONCLUSIVE
    if abs(apart) <= near or low <= 0 <= high:
        return REPRODUCED
    return CLOSE if abs(apart) <= far else NOT_REPRODUCED


def distance(printed: Printed, value: float, tolerance: Tolerance) -> float:
    """Return a value's distance from the printed number, in units of the close tolerance; 0 within its rounding."""
    scale = _log if tolerance.factor else float
    least, most = scale(printed.value - printed.rounding), scale(printed.upper + printed.rounding)
    return _apart(scale(value), min(max(scale(value), least), most)) / scale(tolerance.close)


def judged_once(comparison: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of means, without those that repeat a value of the run that is judged in another row."""
    return comparison[(comparison["statistic"] == "mean") & (comparison["repeat_of"] == "")]


def counts(comparison: pd.DataFrame) -> dict[str, int]:
    """Return verdict -> how many rows have it."""
    return {verdict: int((comparison["verdict"] == verdict).sum()) for verdict in VERDICTS}


def _judge(number, printed, reproduced, objects, tolerance, reasons) -> tuple[str, str]:
    if number.counterpart is None:
        return NOT_COMPARABLE, number.note
    if any(objects[source]["stand_in"] for source in number.counterpart.sources if source in objects):
        return NOT_COMPARABLE, STAND_IN
    if reproduced is None:
        return NOT_RUN, f"{number.counterpart.file} holds no such value"
    verdict = verdict_of(printed, reproduced, tolerance)
    if verdict == INCONCLUSIVE:
        no_interval = math.isnan(reproduced.interval()[0])
        return verdict, LOWER_BOUND if reproduced.at_least else ONE_REPEAT if no_interval else TOO_WIDE
    return verdict, "" if verdict == REPRODUCED else reason_of(number, reasons)


def _sampling(printed: Printed) -> dict[str, float]:
    """Return the bounds that the paper's sampling leaves; NaN where they are not told."""
    is_known = (printed.low, printed.high) != (printed.value, printed.upper)
    return {
        name: round(bound, 6) if is_known else np.nan
        for name, bound in (("paper_low", printed.low), ("paper_high", printed.high))
    }


def _columns(number: Number, reproduced: Reproduced | None, tolerance: Tolerance) -> dict[str, object]:
    """Return the reproduced value, and its distance from the nearest end of the printed number."""
    import pandas as pd

    if reproduced is None:
        return {"n": pd.NA, "at_least": False}
    printed = min(max(reproduced.value, number.value), number.upper)
    return {
        "reproduced": round(reproduced.value, 6),
        "ci_low": round(reproduced.low, 6),
        "ci_high": round(reproduced.high, 6),
        "cluster_low": round(reproduced.cluster_low, 6),
        "cluster_high": round(reproduced.cluster_high, 6),
        "n": reproduced.n,
        "at_least": reproduced.at_least,
        "difference": round(reproduced.value - printed, 6),
        "factor": round(reproduced.value / printed, 6) if tolerance.factor else np.nan,
    }


def _objects(counterpart: Counterpart | None, objects: Mapping[str, Mapping]) -> str:
    sources = counterpart.sources if counterpart else ()
    return ", ".join(title_of(objects[source]) for source in sources if source in objects)


def _hardware(number: Number, results: Mapping[str, pd.DataFrame], hardware: str) -> str:
    """Return the hardware that a time was measured on; empty for all else."""
    counterpart = number.counterpart
    if counterpart is None or counterpart.file not in results or number.unit not in TIMES:
        return ""
    if counterpart.file != RUNTIME:
        return hardware
    rows = results[RUNTIME]
    return ", ".join(rows.loc[rows["device"] == counterpart.concept, "hardware"].unique())


def _deviation_of(number: Number, deviations: Mapping[tuple[str, str], Number]) -> Number | None:
    """Return the standard deviation printed beside a mean: in its row, or in that of the same number."""
    if not number.counterpart or number.counterpart.statistic != "mean":
        return None
    table, row, _ = number.same_as or number.key
    return deviations.get((table, row))


def _log(value: float) -> float:
    return math.log(value) if value > 0 else value if math.isnan(value) else -math.inf


def _apart(one: float, other: float) -> float:
    """Return one minus the other; 0 of equal infinities, as logarithms of 0 are."""
    return 0.0 if one == other else one - other
