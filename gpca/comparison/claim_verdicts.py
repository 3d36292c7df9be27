"""Verdicts on the paper's claims in sentences: few kinds of tests, with margins of equivalence.

A difference is that of two values of the same seed, its interval Student's over the seeds. "As good as" is supported
by two one-sided tests: the whole interval lies within the margin, which an interval that holds 0 need not do.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.diagnostics import calibration_error
from gpca.attribution.metrics import ALL, TIDY_COLUMNS, mean_interval, source_method_seed
from gpca.attribution.predictions import concepts_of, read_predictions
from gpca.comparison.claims import PREDICTIONS, Claim, Compared
from gpca.comparison.published import UNITS, Counterpart
from gpca.comparison.values import RUNTIME, of_seeds, runtime_mean
from gpca.comparison.verdicts import INCONCLUSIVE, NOT_COMPARABLE, NOT_RUN
from gpca.io.csv_file import read_numbers

if TYPE_CHECKING:
    import pandas as pd

SUPPORTED, REFUTED = "supported", "refuted"
CLAIM_VERDICTS = (SUPPORTED, REFUTED, INCONCLUSIVE, NOT_COMPARABLE, NOT_RUN)
CLAIM_COLUMNS = (
    *("claim", "sentence", "place", "test", "unit", "margin", "ratio", "source", "table", "one", "other"),
    *("value", "low", "high", "n", "verdict", "claim_verdict", "note"),
)
LEVEL = 0.95


def judge(
    claims: Sequence[Claim],
    results: Mapping[str, pd.DataFrame],
    objects: Mapping[str, Mapping],
    prediction_files: Iterable[str | Path] = (),
) -> pd.DataFrame:
    """Return `CLAIM_COLUMNS`, a row per comparison, or one for a claim without any.

    A claim is supported if all of its comparisons are. It is refuted if one is by an interval that is as much wider as
    there are comparisons (Bonferroni), so that many do not refute by chance. What the run lacks is not run, and what it
    has of stand-ins only is not comparable; both leave the verdict to the other comparisons.

    Args:
        claims: those of the paper.
        results: file name -> its rows, as :func:`gpca.comparison.values.read_results` reads them.
        objects: source -> ``{"title": str, "stand_in": bool}``.
        prediction_files: named ``…/predictions/{source}/{method}/seed{seed}.csv``, for claims about calibration.
    """
    import pandas as pd

    results = {**results, PREDICTIONS: _calibration(claims, prediction_files)}
    records = []
    for claim in claims:
        own = {"claim": claim.name, "sentence": claim.sentence, "place": claim.place, "note": claim.note}
        if not claim.compared:
            records.append({**own, "verdict": NOT_RUN, "claim_verdict": NOT_RUN})
            continue
        rows, wide = [], []
        strict = 1 - (1 - LEVEL) / len(claim.compared)
        for compared in claim.compared:
            row, verdict = _row(claim, compared, results, objects, strict)
            rows.append(own | row)
            wide.append(verdict)
        of_claim = _of_claim([row["verdict"] for row in rows], wide)
        records += [row | {"claim_verdict": of_claim} for row in rows]
    return pd.DataFrame(records, columns=list(CLAIM_COLUMNS)).astype({"n": "Int64"})


def verdict_of_interval(claim: Claim, low: float, high: float) -> str:
    """Return whether a difference, of logarithms with `ratio`, with these bounds supports or refutes the claim."""
    margin = math.log(claim.margin) if claim.ratio else claim.margin
    if claim.test == "less":
        low, high = -high, -low
    if math.isnan(low) or math.isnan(high):
        return INCONCLUSIVE
    if claim.test in ("greater", "less"):
        supported, refuted = low > 0 and high >= margin, high < margin or high < 0
    elif claim.test == "not_worse":
        supported, refuted = low > -margin, high < -margin
    else:
        supported, refuted = -margin < low and high < margin, low > margin or high < -margin
    return SUPPORTED if supported else REFUTED if refuted else INCONCLUSIVE


def _row(claim: Claim, compared: Compared, results, objects, strict: float) -> tuple[dict, str]:
    """Return the columns of a comparison, and its verdict by the stricter interval."""
    places = compared.counterparts
    row: dict[str, object] = {
        **{"test": claim.test, "unit": claim.unit, "margin": claim.margin, "ratio": claim.ratio},
        **{"source": places[0].sources[0], "table": places[0].table},
        **{"one": _named(compared.one, places), "other": _named(compared.other, places)},
    }
    difference = _difference(claim, compared, results, strict)
    if difference is None:
        return row | {"verdict": NOT_RUN}, NOT_RUN
    value, intervals, n, at_least, at_most = difference
    (low, high), strictly = intervals[LEVEL], intervals[strict]
    shown = (math.exp(bound) if claim.ratio else bound for bound in (value, low, high))
    row |= {name: round(bound, 6) for name, bound in zip(("value", "low", "high"), shown, strict=True)} | {"n": n}
    if any(objects[place.sources[0]]["stand_in"] for place in places if place.sources[0] in objects):
        return row | {"verdict": NOT_COMPARABLE}, NOT_COMPARABLE
    # Of a difference that may be larger or smaller than it looks, one of the two answers stays open.
    may_rise, may_fall = (at_most, at_least) if claim.test == "less" else (at_least, at_most)
    open_to = {SUPPORTED: may_fall or (may_rise and claim.test == "equivalent"), REFUTED: may_rise}
    verdicts = [verdict_of_interval(claim, *bounds) for bounds in ((low, high), strictly)]
    own, strictly_judged = (INCONCLUSIVE if open_to.get(verdict) else verdict for verdict in verdicts)
    return row | {"verdict": own}, strictly_judged


def _of_claim(verdicts: Sequence[str], strict: Sequence[str]) -> str:
    judged = [verdict for verdict in verdicts if verdict not in (NOT_RUN, NOT_COMPARABLE)]
    if not judged:
        return NOT_COMPARABLE if NOT_COMPARABLE in verdicts else NOT_RUN
    if REFUTED in strict:
        return REFUTED
    return SUPPORTED if set(judged) == {SUPPORTED} else INCONCLUSIVE


def _difference(claim: Claim, compared: Compared, results, strict: float):
    """Return the difference, bounds at `LEVEL` and `strict`, repeats, and whether it is a lower and an upper bound."""
    files = {place.file for place in compared.counterparts}
    if not files <= set(results):
        return None
    if files == {RUNTIME}:
        return _of_runtime(claim, compared, results[RUNTIME], (LEVEL, strict))
    values, censored = [], []
    for place in (compared.one, compared.other):
        if isinstance(place, Counterpart):
            value_R, at_least = of_seeds(results[place.file], place)
            values.append(value_R * UNITS[claim.unit].factor)
            censored.append(at_least)
        else:
            values.append(place)
            censored.append(False)
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = (np.log(value) for value in values) if claim.ratio else values
        difference_R = np.asarray((one - other).dropna(), dtype=float)
    if not len(difference_R):
        return None
    if not np.isfinite(difference_R).all():
        difference_R = np.full(len(difference_R), np.nan)
    bounds = {level: mean_interval(difference_R, level)[1:] for level in (LEVEL, strict)}
    return float(difference_R.mean()), bounds, len(difference_R), *censored


def _of_runtime(claim: Claim, compared: Compared, rows: pd.DataFrame, levels: Iterable[float]):
    """Compare mean seconds that were measured apart from one another; of logarithms by the delta method."""
    from scipy.stats import t as student_t

    means = [mean for place in compared.counterparts if (mean := runtime_mean(rows, place)) is not None]
    if len(means) < 2:
        return None
    (one, error, n), (other, other_error, other_n) = means
    n = min(n, other_n)
    if claim.ratio:
        value, error = math.log(one / other), math.hypot(error / one, other_error / other)
    else:
        factor = UNITS[claim.unit].factor
        value, error = factor * (one - other), factor * math.hypot(error, other_error)
    widths = {level: student_t.ppf((1 + level) / 2, n - 1) * error if n > 1 else math.nan for level in levels}
    return value, {level: (value - width, value + width) for level, width in widths.items()}, n, False, False


def _calibration(claims: Sequence[Claim], prediction_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return the calibration errors that the claims ask for, tidy, by seed."""
    import pandas as pd

    wanted = {
        (place.sources[0], place.methods[0])
        for claim in claims
        for compared in claim.compared
        for place in compared.counterparts
        if place.file == PREDICTIONS
    }
    records = []
    for path in prediction_files:
        source, method, seed = source_method_seed(path)
        if (source, method) in wanted and Path(path).parts[-4] == PREDICTIONS:
            rows = read_predictions(path)
            rows = rows[(rows["split"] == "test") & ~rows["abstained"]]
            concepts = concepts_of(rows)
            scores_S_C = rows[[f"score_{concept}" for concept in concepts]].to_numpy(float)
            target_S = np.array([concepts.index(concept) for concept in rows["concept_true"]])
            error = calibration_error(scores_S_C / scores_S_C.sum(axis=1, keepdims=True), target_S)
            records.append(("calibration", source, method, "ece", ALL, seed, error))
    return pd.DataFrame(records, columns=list(TIDY_COLUMNS))


def _named(value: Counterpart | float, places: Sequence[Counterpart]) -> str:
    """Name a value by what distinguishes it from the other: its method, or its metric where both have one method."""
    if not isinstance(value, Counterpart):
        return f"{value:g}"
    if len({place.methods for place in places}) < len(places):
        return f"{value.concept} {value.metrics[0]}"
    return "+".join(value.methods)


def read_verdicts(path: str | Path) -> pd.DataFrame:
    """Read what :func:`judge` returned; claims that were not run have no numbers.

    Raises:
        InputError: missing, empty or unreadable file, missing column, a number that is none.
    """
    measured = ("value", "low", "high", "n")
    return read_numbers(path, CLAIM_COLUMNS, measured, optional=measured)
