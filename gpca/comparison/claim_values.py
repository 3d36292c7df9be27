"""The differences that the paper's claims are judged by: of a run's values, with their intervals.

A difference is that of two values of the same seed, its interval Student's over the seeds. Of shares of samples of
which the run keeps predictions there is a second one, by the bootstrap over clusters and seeds, in which both shares
have the same draws; the farther bounds count.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.confidence import NO_WIDTH
from gpca.attribution.diagnostics import calibration_error
from gpca.attribution.metrics import ALL, TIDY_COLUMNS, mean_interval, source_method_seed
from gpca.attribution.predictions import concepts_of, read_predictions
from gpca.comparison.claims import PREDICTIONS, Claim, Compared, counterparts_of
from gpca.comparison.clusters import Drawn
from gpca.comparison.published import UNITS, Counterpart
from gpca.comparison.values import RUNTIME, of_seeds, runtime_mean

if TYPE_CHECKING:
    import pandas as pd

LEVEL = 0.95
Bounds = tuple[float, float]


@dataclass(frozen=True)
class Difference:
    """A difference of two values, or of their logarithms for a claim about a ratio.

    Attributes:
        bounds: of its interval, by the level.
        n: repeats.
        at_least, at_most: it is a lower bound, or an upper one, as some repeats ended before they were done.
        at_floor: both values are the least that there can be, in at least half of the repeats.
    """

    value: float
    bounds: Mapping[float, Bounds]
    n: int
    at_least: bool = False
    at_most: bool = False
    at_floor: bool = False


def difference_of(
    claim: Claim,
    compared: Compared,
    results: Mapping[str, pd.DataFrame],
    clusters: Mapping[Counterpart, Drawn],
    levels: Iterable[float],
    floor: float | None = None,
) -> Difference | None:
    """Return a comparison's difference in the claim's unit, None where the run lacks it.

    Args:
        claim, compared: what is compared.
        results: file name -> its rows.
        clusters: counterpart -> its draws of clusters and seeds.
        levels: those of the intervals.
        floor: the least value that the unit allows.
    """
    files = {place.file for place in compared.counterparts}
    if not files <= set(results):
        return None
    if files == {RUNTIME}:
        return _of_runtime(claim, compared, results[RUNTIME], levels)
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
    bounds = {level: mean_interval(difference_R, level)[1:] for level in levels}
    if claim.unit == "%" and not claim.ratio:
        if np.ptp(difference_R) < NO_WIDTH:  # seeds that agree do not tell how wide the interval of a share is
            bounds = dict.fromkeys(bounds, (math.nan, math.nan))
        over_clusters = {level: _over_clusters(claim, compared, clusters, level) for level in bounds}
        bounds = {level: _farther(own, over_clusters[level]) for level, own in bounds.items()}
    at_floor = False
    if floor is not None and len(compared.counterparts) == 2:
        at_floor = bool(((values[0] <= floor) & (values[1] <= floor)).mean() >= 0.5)
    at_least, at_most = censored
    return Difference(float(difference_R.mean()), bounds, len(difference_R), at_least, at_most, at_floor)


def _over_clusters(claim: Claim, compared: Compared, clusters: Mapping[Counterpart, Drawn], level: float) -> Bounds:
    """Return the bounds over clusters and seeds in the claim's unit; NaN where a value is no share of samples."""
    factor = UNITS[claim.unit].factor
    one, other = (
        clusters.get(value) if isinstance(value, Counterpart) else value / factor
        for value in (compared.one, compared.other)
    )
    if one is None or other is None:
        return math.nan, math.nan
    if not isinstance(one, float):
        bounds = one.bounds(level) if isinstance(other, float) else one.bounds_of_difference(other, level)
        shift = other if isinstance(other, float) else 0.0
        return factor * (bounds[0] - shift), factor * (bounds[1] - shift)
    if isinstance(other, float):
        return math.nan, math.nan
    low, high = other.bounds(level)
    return factor * (one - high), factor * (one - low)


def _farther(one: Bounds, other: Bounds) -> Bounds:
    """Return the farther bounds of two intervals, of which one may be NaN."""
    return float(np.fmin(one[0], other[0])), float(np.fmax(one[1], other[1]))


def _of_runtime(claim: Claim, compared: Compared, rows: pd.DataFrame, levels: Iterable[float]) -> Difference | None:
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
    return Difference(value, {level: (value - width, value + width) for level, width in widths.items()}, n)


def of_predictions(claims: Sequence[Claim], prediction_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return what the claims ask of the scores in prediction files, tidy, by seed.

    - ece: the expected calibration error.
    - separability: the mean area under the ROC curve by which a class's score tells it from another class, over all
      pairs of classes both ways (Hand and Till 2001).
    """
    import pandas as pd

    wanted = {(p.sources[0], p.methods[0]) for p in counterparts_of(claims) if p.file == PREDICTIONS}
    records = []
    for path in prediction_files:
        source, method, seed = source_method_seed(path)
        if (source, method) in wanted and Path(path).parts[-4] == PREDICTIONS:
            rows = read_predictions(path)
            rows = rows[(rows["split"] == "test") & ~rows["abstained"]]
            concepts = concepts_of(rows)
            scores_S_C = rows[[f"score_{concept}" for concept in concepts]].to_numpy(float)
            p_S_C = scores_S_C / scores_S_C.sum(axis=1, keepdims=True)
            target_S = np.array([concepts.index(concept) for concept in rows["concept_true"]])
            values = {"ece": calibration_error(p_S_C, target_S), "separability": separability(p_S_C, target_S)}
            records += [("scores", source, method, name, ALL, seed, value) for name, value in values.items()]
    return pd.DataFrame(records, columns=list(TIDY_COLUMNS))


def separability(p_S_C: np.ndarray, target_S: np.ndarray) -> float:
    """Return how well scores (S, C) tell the classes apart, 0.5 by chance; NaN for fewer than two classes."""
    from sklearn.metrics import roc_auc_score

    present = np.unique(target_S)
    areas = [
        roc_auc_score(target_S[of_both] == one, p_S_C[of_both, one])
        for one in present
        for other in present
        if one != other
        for of_both in [np.isin(target_S, (one, other))]
    ]
    return float(np.mean(areas)) if areas else math.nan
