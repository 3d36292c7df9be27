"""A verdict on each printed number beside the run's value, with its reason (docs/comparison.md).

Reasons quote the run: ``{metrics.csv attribution @ gpca accuracy all %}`` names file, table, source, method, metric and
concept (for ``runtime.csv``: components, model, component, seconds and device), as published.csv does, and the unit.
An ``@`` stands for the entry of the printed number's counterpart.
"""

import math
import re
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from gpca.comparison.published import TIMES, UNITS, Counterpart, Number, Reason, Unit, reason_of
from gpca.comparison.values import RUNTIME, Reproduced, ShareDraws, deviation_interval, value_of_run
from gpca.errors import InputError
from gpca.evaluation.intervals import student_factor
from gpca.io.frame import Frame
from gpca.objects.entry import STAND_IN, title_of
from gpca.settings import NotNegative

REPRODUCED, CLOSE, INCONCLUSIVE, NOT_REPRODUCED = "reproduced", "close", "inconclusive", "not reproduced"
NOT_COMPARABLE, NOT_RUN = "not comparable", "not run"
DECIDED = (REPRODUCED, CLOSE, NOT_REPRODUCED)
JUDGED = (REPRODUCED, CLOSE, INCONCLUSIVE, NOT_REPRODUCED)
VERDICTS = (*JUDGED, NOT_COMPARABLE, NOT_RUN)
TOO_WIDE = "too wide an interval: it reaches farther than what is close, and does not exclude it"
PAPER_TOO_WIDE = "the paper's own interval reaches farther than what is close, so no run can decide"
ONE_REPEAT = "one repeat, so no interval"
LOWER_BOUND = (
    "some repeats ended before they were done, so the mean is a lower bound; it takes a larger pool, not more seeds"
)
COMPARISON_COLUMNS = (
    *("table", "row", "column", "statistic", "unit", "published", "upper", "decimals"),
    *("paper_low", "paper_high", "deviation", "reproduced", "ci_low", "ci_high", "cluster_low", "cluster_high"),
    *("n", "n_needed", "at_least", "difference", "factor", "verdict", "over_objects"),
    *("repeat_of", "reason", "objects", "hardware"),
)
CITED = ("file", "table", "source", "method", "metric", "concept", "unit")  # fields of a citation
SAME = "@"
MOST_REPEATS = 1_000_000
_CITATION = re.compile(r"\{([^{}]+)\}")
_SENTENCES = re.compile(r"(?<=\.) (?=[A-Z])")


@dataclass(frozen=True)
class Tolerance:
    """Distances up to which a number is reproduced, and close, in its unit or, with `factor`, as a ratio."""

    reproduced: NotNegative
    close: NotNegative
    factor: bool = False

    def __post_init__(self):
        if not (1 if self.factor else 0) <= self.reproduced <= self.close:
            least = "1 <= reproduced <= close" if self.factor else "0 <= reproduced <= close"
            raise InputError("tolerance", f"{self.reproduced:g} and {self.close:g}", f"must satisfy {least}")

    def scale(self, value: float) -> float:
        """Return the value, or its logarithm for a ratio: -inf for numbers that have none."""
        if not self.factor:
            return float(value)
        return math.log(value) if value > 0 else value if math.isnan(value) else -math.inf


class Printed(NamedTuple):
    """A printed number, or the range from `value` to `upper`."""

    value: float
    upper: float
    rounding: float  # half of its last digit
    low: float  # of its 95 % interval, up to `high`; `value` and `upper` where its sampling error is unknown
    high: float


def printed_of(number: Number, deviation: Number | None = None) -> Printed:
    """Return the number with its interval: Wilson's of a share, chi-square of a deviation, Student's of a mean."""
    if number.counterpart and number.counterpart.statistic == "deviation" and number.paper_n > 1:
        low, high = deviation_interval(number.value, number.paper_n)
    elif deviation and deviation.paper_n > 1:
        half_width = student_factor(deviation.paper_n) * deviation.value / math.sqrt(deviation.paper_n)
        low, high = number.value - half_width, number.upper + half_width
    elif number.unit == "%" and number.paper_n:
        from scipy.stats import binomtest

        right = round(number.value / 100 * number.paper_n)
        interval = binomtest(right, number.paper_n).proportion_ci(method="wilson")
        # The printed share is rounded, and may lie beyond the interval of the count.
        low, high = min(100 * interval.low, number.value), max(100 * interval.high, number.value)
    else:
        low, high = number.value, number.upper
    return Printed(number.value, number.upper, number.rounding, float(low), float(high))


def verdict_of(printed: Printed, reproduced: Reproduced, tolerance: Tolerance) -> str:
    """Return one of `JUDGED`.

    The difference of the run's value from the printed number, half a digit wide to either side, has an interval that
    combines both samplings (Newcombe's square-and-add). If it reaches farther than `tolerance.close` from the
    difference, a number is not reproduced where the interval lies beyond that as a whole, else inconclusive. Otherwise
    it is reproduced where the difference is within `tolerance.reproduced` or its interval holds 0.
    """
    scale = tolerance.scale
    near, far = scale(tolerance.reproduced), scale(tolerance.close)
    difference = _difference(printed, reproduced.value, tolerance)
    if reproduced.at_least:
        return NOT_REPRODUCED if difference > far else INCONCLUSIVE
    value, run_low, run_high = (scale(x) for x in (reproduced.value, reproduced.low, reproduced.high))
    below = math.hypot(_minus(value, run_low), _minus(scale(printed.high), scale(printed.upper)))
    above = math.hypot(_minus(run_high, value), _minus(scale(printed.value), scale(printed.low)))
    low, high = difference - below, difference + above
    if not max(below, above) <= far:  # NaN too
        return NOT_REPRODUCED if low > far or high < -far else INCONCLUSIVE
    if abs(difference) <= near or low <= 0 <= high:
        return REPRODUCED
    return CLOSE if abs(difference) <= far else NOT_REPRODUCED


def repeats_needed(printed: Printed, reproduced: Reproduced, tolerance: Tolerance, unit: Unit) -> int | None:
    """Return the fewest repeats of the same mean and spread that are not inconclusive; None if no number is."""

    def decides(n: int) -> bool:
        return verdict_of(printed, reproduced.repeated(n, unit), tolerance) != INCONCLUSIVE

    if reproduced.at_least or math.isnan(reproduced.deviation) or not decides(MOST_REPEATS):
        return None
    return bisect_left(range(MOST_REPEATS), True, lo=2, key=decides)


def _difference(printed: Printed | Number, value: float, tolerance: Tolerance) -> float:
    """Return a value minus the nearest number that is printed alike, both scaled; 0 within the rounding."""
    least, most = (tolerance.scale(x) for x in (printed.value - printed.rounding, printed.upper + printed.rounding))
    scaled = tolerance.scale(value)
    return _minus(scaled, min(max(scaled, least), most))


def distance(number: Number, value: float, tolerance: Tolerance) -> float:
    """Return a value's distance from the printed number, in units of the close tolerance; 0 within its rounding."""
    return _difference(number, value, tolerance) / tolerance.scale(tolerance.close)


def compare(
    numbers: Sequence[Number],
    results: Mapping[str, Frame],
    objects: Mapping[str, Mapping],
    tolerances: Mapping[str, Tolerance],
    reasons: Sequence[Reason],
    hardware: str = "",
    clusters: Mapping[Counterpart, ShareDraws] | None = None,
) -> Frame:
    """Return `COMPARISON_COLUMNS`, a row per printed number, in its unit, given the results by the name of the file.

    Objects are source -> ``{"title": str, "stand_in": bool}``; the hardware is where the file of times does not say.
    """
    import pandas as pd

    deviations: dict[tuple[str, ...], Number] = {
        n.key[:2]: n for n in numbers if n.counterpart and n.counterpart.statistic == "deviation"
    }
    records: list[dict] = []
    values: dict[tuple[str, ...], Reproduced | None] = {}  # by the key of the number
    for number in numbers:
        if number.unit not in tolerances:
            raise InputError("config key comparison.tolerances", f"has no unit '{number.unit}'", "add its tolerance")
        tolerance, counterpart, deviation = tolerances[number.unit], number.counterpart, None
        if counterpart and counterpart.statistic == "mean":  # its deviation is in its row, or in the equal number's
            deviation = deviations.get((number.same_as or number.key)[:2])
        printed = printed_of(number, deviation)
        reproduced = values[number.key] = value_of_run(number, results, clusters)
        sources, reason, needed = counterpart.sources if counterpart else (), "", None
        if counterpart is None:
            verdict, reason = NOT_COMPARABLE, number.note
        elif any(objects[source]["stand_in"] for source in sources if source in objects):
            verdict, reason = NOT_COMPARABLE, STAND_IN
        elif reproduced is None:
            verdict, reason = NOT_RUN, f"{counterpart.file} holds no such value"
        elif (verdict := verdict_of(printed, reproduced, tolerance)) == INCONCLUSIVE:
            needed = repeats_needed(printed, reproduced, tolerance, UNITS[number.unit])
            mean_alone = counterpart.statistic == "mean" and not needed
            reason = LOWER_BOUND if reproduced.at_least else ONE_REPEAT if math.isnan(reproduced.low) else TOO_WIDE
            reason = PAPER_TOO_WIDE if reason == TOO_WIDE and mean_alone else reason
        elif verdict != REPRODUCED:
            reason = reason_of(number, reasons)
        first = values.get(number.same_as)
        repeats = first and reproduced and (first.value, first.n) == (reproduced.value, reproduced.n)
        record = {
            **{name: getattr(number, name) for name in ("table", "row", "column", "unit", "decimals")},
            "statistic": counterpart.statistic if counterpart else "mean",
            "published": number.value,
            "upper": number.upper if number.upper > number.value else np.nan,
            "deviation": deviation.value if deviation else np.nan,
            "n": pd.NA,
            "n_needed": needed or pd.NA,
            "at_least": False,
            "verdict": verdict,
            "over_objects": verdict,
            "repeat_of": " / ".join(number.same_as) if repeats else "",
            "reason": filled(reason, number, results),
            "objects": ", ".join(title_of(objects[source]) for source in sources if source in objects),
            "hardware": "",
        }
        if (printed.low, printed.high) != (printed.value, printed.upper):
            record |= {"paper_low": round(printed.low, 6), "paper_high": round(printed.high, 6)}
        if reproduced is not None:
            nearest = min(max(reproduced.value, number.value), number.upper)
            shown = {"reproduced": reproduced.value, "ci_low": reproduced.low, "ci_high": reproduced.high}
            shown |= {name: getattr(reproduced, name) for name in ("cluster_low", "cluster_high")}
            shown |= {"difference": reproduced.value - nearest}
            shown |= {"factor": reproduced.value / nearest} if tolerance.factor else {}
            record |= {name: round(value, 6) for name, value in shown.items()}
            record |= {"n": reproduced.n, "at_least": reproduced.at_least}
            if verdict in JUDGED:
                record["over_objects"] = verdict_of(printed, reproduced.over_objects(), tolerance)
        if counterpart and counterpart.file in results and number.unit in TIMES:
            record["hardware"] = hardware
            if counterpart.file == RUNTIME:
                by_device = results[RUNTIME].groupby("device")["hardware"].unique()
                record["hardware"] = ", ".join(by_device.get(counterpart.concept, ()))
        records.append(record)
    return pd.DataFrame(records, columns=list(COMPARISON_COLUMNS)).astype({"n": "Int64", "n_needed": "Int64"})


def judged_once(comparison: Frame) -> Frame:
    """Return the rows of means, without those that repeat a value of the run that is judged in another row."""
    return comparison[(comparison["statistic"] == "mean") & (comparison["repeat_of"] == "")]


def counts(comparison: Frame) -> dict[str, int]:
    return {verdict: int((comparison["verdict"] == verdict).sum()) for verdict in VERDICTS}


def _minus(one: float, other: float) -> float:
    """Return one minus the other; 0 for equal infinities, such as logarithms of 0."""
    return 0.0 if one == other else one - other


def citations(text: str) -> list[dict[str, str]]:
    """Return the values that a reason cites, by `CITED`; a citation that lacks a field raises ValueError."""
    return [dict(zip(CITED, words.split(), strict=True)) for words in _CITATION.findall(text)]


def cited_number(number: Number, fields: Mapping[str, str]) -> Number | None:
    """Return the number whose value a reason for `number` cites; None where that has no counterpart."""
    if (counterpart := number.counterpart) is None:
        return None
    cited: dict[str, Any] = {name: fields[name] for name in ("file", "table", "concept") if fields[name] != SAME}
    cited |= {f"{name}s": (fields[name],) for name in ("source", "method", "metric") if fields[name] != SAME}
    return replace(number, unit=fields["unit"], counterpart=replace(counterpart, **cited))


def filled(text: str, number: Number, results: Mapping[str, Frame]) -> str:
    """Return a reason for a number with the run's values; sentences that cite what the run lacks are left out."""
    sentences = []
    for sentence in _SENTENCES.split(text):
        for fields in citations(sentence):
            cited = cited_number(number, fields)
            value = value_of_run(cited, results) if cited else None
            if value is None:
                break
            form = {"%": ".1f", "labels": ".0f", "epochs": ".0f"}.get(fields["unit"], ".2g")
            quoted = f"more than {value.value:{form}}" if value.at_least else f"{value.value:{form}}"
            sentence = _CITATION.sub(lambda _, quoted=quoted: quoted, sentence, count=1)
        else:
            sentences.append(sentence)
    return " ".join(sentences)
