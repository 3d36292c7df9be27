"""Verdicts on the paper's claims in sentences: few kinds of tests, with margins of equivalence.

"As good as" is supported by two one-sided tests: the whole interval lies within the margin, which an interval that
holds 0 need not do. A difference on the claimed side that is smaller than the margin is no refutation, and has a word
of its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from gpca.attribution.metrics import ALL
from gpca.comparison.claim_values import LEVEL, Difference, difference_of, of_predictions
from gpca.comparison.claims import PREDICTIONS, Claim, Compared
from gpca.comparison.clusters import Drawn
from gpca.comparison.published import Counterpart
from gpca.comparison.verdicts import INCONCLUSIVE, NOT_COMPARABLE, NOT_RUN
from gpca.io.csv_file import read_numbers

if TYPE_CHECKING:
    import pandas as pd

SUPPORTED, REFUTED, SMALLER = "supported", "refuted", "smaller than the margin"
CLAIM_VERDICTS = (SUPPORTED, SMALLER, REFUTED, INCONCLUSIVE, NOT_COMPARABLE, NOT_RUN)
CLAIM_COLUMNS = (
    *("claim", "sentence", "place", "test", "unit", "margin", "ratio", "source", "table", "one", "other"),
    *("value", "low", "high", "n", "at_floor", "verdict", "claim_verdict", "note", "margin_set", "values_known"),
)


def judge(
    claims: Sequence[Claim],
    results: Mapping[str, pd.DataFrame],
    objects: Mapping[str, Mapping],
    prediction_files: Iterable[str | Path] = (),
    clusters: Mapping[Counterpart, Drawn] = MappingProxyType({}),
    floors: Mapping[str, float] = MappingProxyType({}),
) -> pd.DataFrame:
    """Return `CLAIM_COLUMNS`, a row per comparison, or one for a claim without any.

    A claim is supported if all of its comparisons are. It is refuted, or smaller than the margin, if one is by an
    interval that is as much wider as there are comparisons (Bonferroni), so that many do not refute by chance. What the
    run lacks is not run, and what it has of stand-ins only is not comparable; both leave the verdict to the other
    comparisons.

    Args:
        claims: those of the paper.
        results: file name -> its rows, as :func:`gpca.comparison.values.read_results` reads them.
        objects: source -> ``{"title": str, "stand_in": bool}``.
        prediction_files: named ``…/predictions/{source}/{method}/seed{seed}.csv``, for claims about scores.
        clusters: counterpart -> its draws of clusters and seeds, for claims about shares of samples.
        floors: unit -> the least value that a run can have. Where both values are at it in at least half of the seeds,
            nothing can be said.
    """
    import pandas as pd

    results = {**results, PREDICTIONS: of_predictions(claims, prediction_files)}
    records = []
    for claim in claims:
        own = {name: getattr(claim, name) for name in ("sentence", "place", "note", "margin_set", "values_known")}
        own["claim"] = claim.name
        if not claim.compared:
            records.append({**own, "verdict": NOT_RUN, "claim_verdict": NOT_RUN})
            continue
        rows, wide = [], []
        strict = 1 - (1 - LEVEL) / len(claim.compared)
        for compared in claim.compared:
            difference = difference_of(claim, compared, results, clusters, (LEVEL, strict), floors.get(claim.unit))
            row, verdict = _row(claim, compared, difference, objects, strict)
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
        supported, refuted = low > 0 and high >= margin, high < 0
        if 0 <= high < margin:
            return SMALLER
    elif claim.test == "not_worse":
        supported, refuted = low > -margin, high < -margin
    else:
        supported, refuted = -margin < low and high < margin, low > margin or high < -margin
    return SUPPORTED if supported else REFUTED if refuted else INCONCLUSIVE


def _row(claim: Claim, compared: Compared, difference: Difference | None, objects, strict: float) -> tuple[dict, str]:
    """Return the columns of a comparison, and its verdict by the stricter interval."""
    places = compared.counterparts
    row: dict[str, object] = {
        **{"test": claim.test, "unit": claim.unit, "margin": claim.margin, "ratio": claim.ratio},
        **{"source": places[0].sources[0], "table": places[0].table, "at_floor": False},
        **{"one": _named(compared.one, places), "other": _named(compared.other, places)},
    }
    if difference is None:
        return row | {"verdict": NOT_RUN}, NOT_RUN
    (low, high), strictly = (difference.bounds[level] for level in (LEVEL, strict))
    shown = (math.exp(bound) if claim.ratio else bound for bound in (difference.value, low, high))
    row |= {name: round(bound, 6) for name, bound in zip(("value", "low", "high"), shown, strict=True)}
    row |= {"n": difference.n, "at_floor": difference.at_floor}
    if any(objects[place.sources[0]]["stand_in"] for place in places if place.sources[0] in objects):
        return row | {"verdict": NOT_COMPARABLE}, NOT_COMPARABLE
    if difference.at_floor:
        return row | {"verdict": INCONCLUSIVE}, INCONCLUSIVE
    # Of a difference that may be larger or smaller than it looks, one of the answers stays open.
    may_rise, may_fall = difference.at_least, difference.at_most
    if claim.test == "less":
        may_rise, may_fall = may_fall, may_rise
    open_to = {
        SUPPORTED: may_fall or (may_rise and claim.test == "equivalent"),
        SMALLER: may_rise or may_fall,
        REFUTED: may_rise,
    }
    verdicts = [verdict_of_interval(claim, *bounds) for bounds in ((low, high), strictly)]
    own, strictly_judged = (INCONCLUSIVE if open_to.get(verdict) else verdict for verdict in verdicts)
    return row | {"verdict": own}, strictly_judged


def _of_claim(verdicts: Sequence[str], strict: Sequence[str]) -> str:
    judged = [verdict for verdict in verdicts if verdict not in (NOT_RUN, NOT_COMPARABLE)]
    if not judged:
        return NOT_COMPARABLE if NOT_COMPARABLE in verdicts else NOT_RUN
    for verdict in (REFUTED, SMALLER):
        if verdict in strict:
            return verdict
    return SUPPORTED if set(judged) == {SUPPORTED} else INCONCLUSIVE


def _named(value: Counterpart | float, places: Sequence[Counterpart]) -> str:
    """Name a value by what distinguishes it from the other: its method, or its metric where both have one method.

    Beside a number stands also the concept that it is of.
    """
    if not isinstance(value, Counterpart):
        return f"{value:g}"
    if len(places) == 1 and value.concept != ALL:
        return f"{'+'.join(value.methods)} {value.concept}"
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
