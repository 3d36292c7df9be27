"""The paper's claims in sentences (``claims.yaml``), the verdict on each from a run's differences, and their table."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from gpca.attribution.diagnostics import calibration_error
from gpca.attribution.learner_predictions import probabilities
from gpca.attribution.predictions import read_predictions
from gpca.comparison.published import UNITS, Counterpart
from gpca.comparison.values import RUNTIME, ShareDraws, runtime_mean, values_by_seed
from gpca.comparison.verdicts import INCONCLUSIVE, NOT_COMPARABLE, NOT_RUN
from gpca.evaluation.intervals import ANYTHING, NO_WIDTH, mean_interval, student_factor
from gpca.evaluation.measures import ALL, TIDY_COLUMNS, source_method_seed
from gpca.io.csv_file import read_numbers
from gpca.io.frame import Frame
from gpca.io.structured_text import load_own_yaml
from gpca.objects.entry import title_of
from gpca.reporting.tables.builder import TableBuilder
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import plural, span

CLAIMS = Path(__file__).with_name("claims.yaml")
PREDICTIONS = "predictions"  # in the place of a file: scores' measures that are computed from predictions
FIRST_SET = "2026-11-22"  # a day after the first reference on real objects, which had shown the differences
LEVEL = 0.95
SUPPORTED, REFUTED, SMALLER = "supported", "refuted", "smaller than the margin"
CLAIM_VERDICTS = (SUPPORTED, SMALLER, REFUTED, INCONCLUSIVE, NOT_COMPARABLE, NOT_RUN)
CLAIM_COLUMNS = (
    *("claim", "sentence", "place", "test", "unit", "margin", "ratio", "source", "table", "one", "other"),
    *("value", "low", "high", "n", "at_floor", "verdict", "claim_verdict", "note", "margin_set", "values_known"),
)


class Compared(NamedTuple):
    """Two values that a claim compares: a run's, or a constant in the claim's unit."""

    one: Counterpart | float
    other: Counterpart | float

    @property
    def counterparts(self) -> list[Counterpart]:
        """Return those of the two values that a run has to provide."""
        return [value for value in self if isinstance(value, Counterpart)]


@dataclass(frozen=True)
class Claim:
    """A claim of the paper in one sentence."""

    name: str
    sentence: str
    place: str
    test: str = ""  # greater, less, not_worse or equivalent
    margin: float = 0.0  # the smallest difference that counts, in `unit`; with `ratio`, a factor
    unit: str = ""
    ratio: bool = False
    margin_set: str = FIRST_SET  # the day on which the margin entered git
    values_known: bool = True  # whether the differences had been seen by then
    compared: tuple[Compared, ...] = ()  # all have to hold; empty where nothing was run, and then `note` says why
    note: str = ""


@dataclass(frozen=True)
class ClaimDifference:
    """A difference of two values, or of their logarithms for a claim about a ratio."""

    value: float
    bounds: Mapping[float, tuple[float, float]]  # of its interval, by level
    n: int  # repeats
    censored: Sequence[bool] = (False, False)  # whether some repeats were, of the first value and of the second
    at_floor: bool = False  # both values are at the unit's minimum in at least half of the repeats


def read_claims() -> list[Claim]:
    """Return the claims, in the order of the file; a test checks it against the rules at its head."""

    def value(shared: Mapping, entry: str | float | Mapping) -> Counterpart | float:
        if isinstance(entry, int | float):
            return float(entry)
        full = {**shared, **(entry if isinstance(entry, Mapping) else {"method": entry})}
        place = (full["in_file"], full["in_table"], (full["source"],))
        methods, metrics = tuple(full["method"].split("+")), tuple(full["metric"].split("/"))
        return Counterpart(*place, methods, metrics, full["concept"], "mean")

    claims = []
    for entry in load_own_yaml(CLAIMS):
        compared, of = [], entry.get("of", {})
        listed = [each if isinstance(each, list) else [each] for each in (of.get("source"), of.get("in_table"))]
        for comparison in entry.get("comparisons", ()):
            for other, source, table in product(comparison["others"], *listed):
                shared = {**of, "source": source, "in_table": table}
                compared.append(Compared(value(shared, comparison["one"]), value(shared, other)))
        fields = {name: each for name, each in entry.items() if name not in ("of", "comparisons")}
        claims.append(Claim(**fields, compared=tuple(compared)))
    return claims


def counterparts_of(claims: Iterable[Claim]) -> list[Counterpart]:
    return [counterpart for claim in claims for compared in claim.compared for counterpart in compared.counterparts]


def judge(
    claims: Sequence[Claim],
    results: Mapping[str, Frame],
    objects: Mapping[str, Mapping],
    prediction_files: Iterable[str | Path] = (),
    clusters: Mapping[Counterpart, ShareDraws] = MappingProxyType({}),
    floors: Mapping[str, float] = MappingProxyType({}),
) -> Frame:
    """Return `CLAIM_COLUMNS`, a row per comparison, or one for a claim without any.

    A claim is supported if all of its comparisons are. It is refuted, or smaller than the margin, if one comparison is
    by a Bonferroni interval (level divided by the number of comparisons). Where the run lacks values, or has those of
    stand-ins, the other comparisons decide. Floors are the minimum by unit.
    """
    import pandas as pd

    results = {**results, PREDICTIONS: score_measures(claims, prediction_files)}
    records = []
    for claim in claims:
        fields = {"claim": claim.name, **vars(claim)}
        if not claim.compared:
            uncompared = dict.fromkeys(("test", "unit", "margin", "ratio"))
            records.append(fields | uncompared | {"verdict": NOT_RUN, "claim_verdict": NOT_RUN})
            continue
        rows, strict_verdicts = [], []
        levels = LEVEL, 1 - (1 - LEVEL) / len(claim.compared)
        for compared in claim.compared:
            counterparts = compared.counterparts
            row: dict[str, Any] = {"source": counterparts[0].sources[0], "table": counterparts[0].table}
            row |= {"at_floor": False, "one": _name(compared.one, compared), "other": _name(compared.other, compared)}
            verdicts = [NOT_RUN, NOT_RUN]  # by these levels
            difference = difference_of(claim, compared, results, clusters, levels, floors.get(claim.unit))
            if difference is not None:
                shown = (difference.value, *difference.bounds[LEVEL])
                for name, number in zip(("value", "low", "high"), shown, strict=True):
                    row[name] = round(math.exp(number) if claim.ratio else number, 6)
                row |= {"n": difference.n, "at_floor": difference.at_floor}
                sources = (each.sources[0] for each in counterparts)
                if any(objects[source]["stand_in"] for source in sources if source in objects):
                    verdicts = [NOT_COMPARABLE] * 2
                elif difference.at_floor:
                    verdicts = [INCONCLUSIVE] * 2
                else:
                    bounds = (difference.bounds[level] for level in levels)
                    verdicts = [verdict_of_interval(claim, *each, *difference.censored) for each in bounds]
            rows.append(fields | row | {"verdict": verdicts[0]})
            strict_verdicts.append(verdicts[1])
        found = {row["verdict"] for row in rows}
        if judged := found - {NOT_RUN, NOT_COMPARABLE}:
            against = (verdict for verdict in (REFUTED, SMALLER) if verdict in strict_verdicts)
            claim_verdict = next(against, SUPPORTED if judged == {SUPPORTED} else INCONCLUSIVE)
        else:
            claim_verdict = NOT_COMPARABLE if NOT_COMPARABLE in found else NOT_RUN
        records += [row | {"claim_verdict": claim_verdict} for row in rows]
    return pd.DataFrame(records, columns=list(CLAIM_COLUMNS)).astype({"n": "Int64"})


def _name(value: Counterpart | float, compared: Compared) -> str:
    """Name a value by what distinguishes it from the other: its method, its metric if they share that, its concept."""
    counterparts = compared.counterparts
    if not isinstance(value, Counterpart):
        return f"{value:g}"
    if len(counterparts) == 1 and value.concept != ALL:
        return f"{'+'.join(value.methods)} {value.concept}"
    if len({counterpart.methods for counterpart in counterparts}) < len(counterparts):
        return f"{value.concept} {value.metrics[0]}"
    return "+".join(value.methods)


def verdict_of_interval(claim: Claim, low: float, high: float, may_rise: bool = False, may_fall: bool = False) -> str:
    """Return the verdict by the bounds of a difference; a censored one may rise or fall, which leaves some open."""
    margin = math.log(claim.margin) if claim.ratio else claim.margin
    if claim.test == "less":
        low, high, may_rise, may_fall = -high, -low, may_fall, may_rise
    if math.isnan(low) or math.isnan(high):
        return INCONCLUSIVE
    if claim.test in ("greater", "less"):
        supported, refuted = low > 0 and high >= margin, high < 0
        if 0 <= high < margin:
            return INCONCLUSIVE if may_rise or may_fall else SMALLER
    elif claim.test == "not_worse":
        supported, refuted = low > -margin, high < -margin
    else:
        supported, refuted = -margin < low and high < margin, low > margin or high < -margin
        may_fall |= may_rise
    if supported:
        return INCONCLUSIVE if may_fall else SUPPORTED
    return REFUTED if refuted and not may_rise else INCONCLUSIVE


def difference_of(
    claim: Claim,
    compared: Compared,
    results: Mapping[str, Frame],
    clusters: Mapping[Counterpart, ShareDraws],
    levels: Iterable[float],
    floor: float | None = None,
) -> ClaimDifference | None:
    """Return a difference in the claim's unit, with intervals of these levels; None if the run lacks it."""
    files, factor = {counterpart.file for counterpart in compared.counterparts}, UNITS[claim.unit].factor
    if not files <= set(results):
        return None
    if files == {RUNTIME}:
        return _runtime_difference(claim, compared, results[RUNTIME], levels)
    values: list[Any] = [*compared]  # a series by seed, or a constant
    censored = [False, False]
    for i, value in enumerate(values):
        if isinstance(value, Counterpart):
            value_R, censored[i] = values_by_seed(results[value.file], value)
            values[i] = value_R * factor
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = (np.log(value) for value in values) if claim.ratio else values
        difference_R = np.asarray((one - other).dropna(), dtype=float)
    if not len(difference_R):
        return None
    if not np.isfinite(difference_R).all():
        difference_R = np.full(len(difference_R), np.nan)
    bounds = {level: mean_interval(difference_R, level)[1:] for level in levels}
    if claim.unit == "%" and not claim.ratio:
        if np.ptp(difference_R) < NO_WIDTH:  # equal seeds do not show how wide the interval of a share is
            bounds = dict.fromkeys(bounds, (math.nan, math.nan))
        for level, (low, high) in bounds.items():
            cluster_low, cluster_high = (factor * bound for bound in _cluster_bounds(compared, clusters, level, factor))
            bounds[level] = float(np.fmin(low, cluster_low)), float(np.fmax(high, cluster_high))
    at_floor = False
    if floor is not None and len(compared.counterparts) == 2:
        at_floor = bool(((values[0] <= floor) & (values[1] <= floor)).mean() >= 0.5)
    return ClaimDifference(float(difference_R.mean()), bounds, len(difference_R), censored, at_floor)


def _cluster_bounds(
    compared: Compared, clusters: Mapping[Counterpart, ShareDraws], level: float, factor: float
) -> tuple[float, float]:
    """Return the bounds over clusters and seeds; NaN where a value is no share of samples."""
    one, other = (clusters.get(each) if isinstance(each, Counterpart) else each / factor for each in compared)
    match one, other:
        case ShareDraws(), ShareDraws():
            return one.bounds(level, minus=other)
        case ShareDraws(), float():
            low, high = one.bounds(level)
            return low - other, high - other
        case float(), ShareDraws():
            low, high = other.bounds(level)
            return one - high, one - low
    return math.nan, math.nan


def _runtime_difference(
    claim: Claim, compared: Compared, rows: Frame, levels: Iterable[float]
) -> ClaimDifference | None:
    """Compare mean seconds of independent measurements; logarithms by the delta method."""
    means = [mean for counterpart in compared.counterparts if (mean := runtime_mean(rows, counterpart)) is not None]
    if len(means) < 2:
        return None
    (one, error, n), (other, other_error, other_n) = means
    n = min(n, other_n)
    if claim.ratio:
        value, error = math.log(one / other), math.hypot(error / one, other_error / other)
    else:
        factor = UNITS[claim.unit].factor
        value, error = factor * (one - other), factor * math.hypot(error, other_error)
    widths = {level: student_factor(n, level) * error for level in levels}
    return ClaimDifference(value, {level: (value - width, value + width) for level, width in widths.items()}, n)


def score_measures(claims: Sequence[Claim], prediction_files: Iterable[str | Path]) -> Frame:
    """Return tidy rows of ece and :func:`separability` of the scores in prediction files that the claims compare."""
    import pandas as pd

    wanted = {(c.sources[0], c.methods[0]) for c in counterparts_of(claims) if c.file == PREDICTIONS}
    records = []
    for path in prediction_files:
        source, method, seed = source_method_seed(path)
        if (source, method) in wanted and Path(path).parts[-4] == PREDICTIONS:
            rows = read_predictions(path)
            rows = rows[(rows["split"] == "test") & ~rows["abstained"]]
            scores_S_C, target_S = probabilities(rows)
            p_S_C = scores_S_C / scores_S_C.sum(axis=1, keepdims=True)
            values = {"ece": calibration_error(p_S_C, target_S), "separability": separability(p_S_C, target_S)}
            records += [("scores", source, method, name, ALL, seed, value) for name, value in values.items()]
    return pd.DataFrame(records, columns=list(TIDY_COLUMNS))


def separability(p_S_C: np.ndarray, target_S: np.ndarray) -> float:
    """Return the mean pairwise AUROC of scores, over all ordered pairs of classes (Hand and Till 2001); NaN for one."""
    from sklearn.metrics import roc_auc_score

    if len(np.unique(target_S)) < 2:
        return math.nan
    return float(roc_auc_score(target_S, p_S_C, multi_class="ovo", labels=range(p_S_C.shape[1])))


def read_verdicts(path: str | Path) -> Frame:
    """Read what :func:`judge` returned; claims that were not run have no numbers."""
    measured = ("value", "low", "high", "n")
    return read_numbers(path, CLAIM_COLUMNS, measured, optional=measured)


HEADS = {"claim": "The paper", "claim_verdict": "Verdict", "source": "Dataset", "table": "Samples"}
HEADS |= {"compared": "Compared", "expected": "Expected", "verdict": "Holds"}
_TESTS = {"greater": "greater", "less": "less", "not_worse": "not worse", "equivalent": "the same"}


@dataclass(frozen=True)
class ThreeDigits(Column):
    """Shows numbers of any unit with three digits, with the bounds of the interval where there is one."""

    limits: tuple[float, float] = ANYTHING

    def text(self, cell: Cell) -> str:
        """Return e.g. ``-1.2 (-2.1 to 0.3)``, or ``0.592``."""
        low, high = cell.bounds or (math.nan, math.nan)
        interval = "" if math.isnan(low) else f" ({low:.3g} to {high:.3g})"
        return f"{cell.mean:.3g}{interval}"


def claims(verdicts: Frame, sources: Mapping[str, Mapping], titles: Mapping[str, str]) -> Table:
    """Return a row per comparison, below the sentence that it belongs to; titles are those of methods."""

    def titled(name: str) -> str:
        method, _, concept = name.partition(" ")
        return f"{titles[method]} {concept}".rstrip() if method in titles else name

    table = TableBuilder("claims", HEADS)
    seen: set[str] = set()
    for row in verdicts[verdicts["verdict"] != NOT_RUN].itertuples():
        first, margin = row.claim not in seen, float(row.margin)
        seen.add(row.claim)
        unit = "" if row.unit in ("correlation", "risk", "share") else f" {row.unit}"
        by = f", by × {margin:g}" if row.ratio == "True" else f", by {margin:g}{unit}" if margin else ""
        table.add_row(
            [
                (row.claim, f"{row.sentence} ({row.place})" if first else ""),
                (row.claim_verdict, row.claim_verdict if first else ""),
                (row.source, title_of(sources[row.source]) if row.source in sources else row.source),
                (row.table, row.table.rpartition("/")[2].replace("_", " ")),
                (f"{row.one} against {row.other}", f"{titled(row.one)} against {titled(row.other)}"),
                (row.test, _TESTS[row.test] + by),
                (row.verdict, f"{row.verdict} (floor)" if row.at_floor == "True" else row.verdict),
            ],
            {"difference": Cell(row.value, row.high - row.value, int(row.n), 0, bounds=(row.low, row.high))},
        )
    by_seed = verdicts[verdicts["n"].notna() & (verdicts["table"] != "components")]  # whose times are of repeats
    seeds = plural(span(by_seed["n"]), "seed") if len(by_seed) else "repeats"
    not_run = verdicts[verdicts["claim_verdict"] == NOT_RUN].drop_duplicates("claim").itertuples()
    return table.build(
        caption="What the paper says in sentences, and whether the differences in this run support it",
        column_head="quantity",
        columns={"difference": ThreeDigits("First minus second, or their ratio")},
        footnotes=(
            counted(verdicts),
            f"In brackets: the 95 % interval over {seeds} of differences of the same seed, or of accuracies the "
            "farther bounds of it and of one over clusters of objects or scenes. Floor: both are at the first labels, "
            "so the difference is unknown. docs/appendix.md has the whole rule.",
            *margins_in_words(verdicts),
            *(f"Not run: {row.sentence} ({row.place}){': ' if row.note else ''}{row.note}." for row in not_run),
        ),
    )


def counted(verdicts: Frame) -> str:
    counts = verdicts.drop_duplicates("claim")["claim_verdict"].value_counts(sort=False)
    phrases = (f"{counts[verdict]} {verdict}" for verdict in CLAIM_VERDICTS if verdict in counts)
    return f"Of {counts.sum()} sentences: {', '.join(phrases)}."


def margins_in_words(verdicts: Frame) -> list[str]:
    once = verdicts.drop_duplicates("claim")
    phrases = []
    for (day, seen), day_rows in once[once["test"] != ""].groupby(["margin_set", "values_known"], sort=True):
        before = "after the differences had been seen" if seen == "True" else "before the differences were looked at"
        phrases.append(f"{len(day_rows)} on {day}, {before}")
    return [f"Margins were set for {'; '.join(phrases)}."] if phrases else []
