"""Registrations of scans to scans whose causes are measured: real sensors, real overlap, nothing of it simulated.

What may be taken away from a pair, and what is added to it, says :mod:`gpca.causes.scan_candidate`. The source moves
onto the target. Its errors are root mean square distances over the surface that both scans truly have in common, scaled
so that the limit of success is that of all other experiments.

A *natural* registration has no added noise: it is what an estimate by a local method makes of two scans as they are.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.causes.counterfactuals import Counterfactuals, Registrar, Unmeasurable
from gpca.causes.dataset import Causes
from gpca.causes.measuring import Measuring, as_causes
from gpca.causes.scan_candidate import DrawnScans
from gpca.causes.settings import FEWEST_POINTS, CauseSettings
from gpca.causes.shapley import ALL, NONE
from gpca.causes.subjects import Subject
from gpca.errors import InputError
from gpca.objects.canonical import DRAWN
from gpca.pairs.perturbation import CONCEPTS, SEVERITIES
from gpca.process.progress import progress
from gpca.scans.pair import ScanPair, ScanSuccess
from gpca.scans.scene import ScanPairs
from gpca.seeds import generator
from gpca.uncertainty.spread import divergence

if TYPE_CHECKING:
    import pandas as pd

LADDER, GLOBAL = KINDS = ("ladder", "global")


@dataclass(frozen=True)
class ScanStart:
    """Where a registration of a pair begins, and with how much more noise.

    Attributes:
        pair: its number.
        kind: ``ladder``: the true pose, disturbed by a rung; ``global``: the pose that a global method found.
        init_from: the rung or the method.
        T_target_source: 4×4, meters.
        times: how much noise is added, in units of the sensor's; 0 where the registration is natural.
        found: what global methods found of the pair, 4×4 each, in meters: an observer may know it.
    """

    pair: int
    kind: str
    init_from: str
    T_target_source: np.ndarray
    times: float = 0.0
    found: tuple[np.ndarray, ...] = ()


def measure_scans(
    pairs: ScanPairs,
    starts: Sequence[ScanStart],
    source: str,
    seed: int,
    settings: CauseSettings,
    success: ScanSuccess,
    points: int,
) -> tuple[Causes, pd.DataFrame]:
    """Measure the causes of registrations from these starts, those of a pair one after another.

    One that finds no correspondence is measured where it started. Pairs of which too few points lie on surface that
    both scans see are left out and named on stderr.

    Args:
        settings: of the truth; what it says of candidates is not read.
        points: of each scan, at most.

    Returns:
        the registrations, all of them test samples with the number of their start; a row for each of what it is and
        what was found.

    Raises:
        InputError: no registration can be measured.
    """
    drawn: dict[int, DrawnScans] = {}
    limits: list[float] = []
    for k in progress(sorted({start.pair for start in starts}), f"clean pairs of {source}, seed {seed}"):
        scans = _drawn(pairs[k], (source, seed), settings, success, points)
        try:
            limits.append(_clean_uncertainty(scans, (source, seed), settings, success, points))
            drawn[k] = scans
        except Unmeasurable as fault:
            print(f"causes of {source}: pair {scans.pair.name} is skipped: {fault}", file=sys.stderr)
    measuring = Measuring(settings, float(np.quantile(limits, settings.limits.clean)) if limits else 0.0)
    records, seen = [], []
    for number, start in enumerate(progress(starts, f"causes of {source}, seed {seed}")):
        if start.pair not in drawn:
            continue
        scans = drawn[start.pair]
        try:
            record = _measured(scans, start, measuring, (source, seed))
        except Unmeasurable as fault:
            name = f"pair {scans.pair.name} ({start.kind}, {start.init_from})"
            print(f"causes of {source}: {name} is skipped: {fault}", file=sys.stderr)
            continue
        records.append(record | {"sample": number, "split": "test", "candidate": number})
        seen.append((start, scans))
    if not records:
        raise InputError(f"causes of {source}", "no registration of the scans can be measured", "check their poses")
    causes, _ = as_causes(records, (source, seed))
    return causes, _table(seen, causes)


def _drawn(
    pair: ScanPair, axes: tuple, settings: CauseSettings, success: ScanSuccess, points: int, part: str = "points"
) -> DrawnScans:
    random = generator(*axes, "scan causes", pair.name, part)
    return DrawnScans.of(pair, points, success.limit_m(pair), settings.limits.failed, random)


def _clean_uncertainty(
    scans: DrawnScans, axes: tuple, settings: CauseSettings, success: ScanSuccess, points: int
) -> float:
    """Return the divergence between two registrations of a pair that nothing is wrong with: of other points of both."""
    pair = scans.pair
    others = _drawn(pair, axes, settings, success, points, "other points")
    xi_n_6 = generator(*axes, "scan causes", pair.name, "clean").normal(size=(settings.starts, 6))
    covariances = []
    for each in (scans, others):
        _require_common(each)
        candidate = each.candidate(pair.T_target_source, 0.0, generator(*axes, "nothing is drawn"))
        registrar = Registrar(candidate, settings, misses=True)
        measured = Counterfactuals(registrar, each.errors, xi_n_6 * settings.deviation_6(), settings)
        covariances.append(measured.covariance(NONE))
    first, second = covariances
    return float(divergence(first, second, settings.floor))


def _require_common(scans: DrawnScans) -> None:
    if min(len(scans.source_common), len(scans.target_common)) < FEWEST_POINTS:
        raise Unmeasurable("too few of its points lie on surface that both scans see")


def _measured(scans: DrawnScans, start: ScanStart, measuring: Measuring, axes: tuple) -> dict[str, Any]:
    axes = (*axes, "scan causes", scans.pair.name, start.init_from)  # the same starts, however much noise is added
    candidate = scans.candidate(start.T_target_source, start.times, generator(*axes, "noise", start.times))
    registrar = Registrar(candidate, measuring.settings, misses=True)
    subject = _subject(scans, start.pair)
    truths = [
        measuring.truth(measuring.counterfactuals(registrar, subject, axes, drawn))
        for drawn in ("starts", "other starts")
    ]
    return {**measuring.observed(registrar, subject, axes), "truth": truths[0], "again": truths[1]}


def _subject(scans: DrawnScans, number: int) -> Subject:
    """Return the pair in the place of an object, and its scene in that of a family."""
    return Subject(
        index=number,
        name=scans.pair.name,
        diameter_m=scans.unit_m,
        surface=scans.target,
        symmetric=False,
        errors=scans.errors,
        family=scans.pair.cluster,
        fold=DRAWN,
    )


def _table(seen: Sequence[tuple[ScanStart, DrawnScans]], causes: Causes) -> pd.DataFrame:
    import pandas as pd

    registrations, truth = causes.registrations, causes.truth
    starts, scans = zip(*seen, strict=True)
    told = {"pair": [each.pair.name for each in scans], "cluster": registrations.cluster}
    told |= {"kind": [each.pair.kind for each in scans], "overlap": [each.pair.overlap for each in scans]}
    told |= {"start": [start.kind for start in starts], "init_from": [start.init_from for start in starts]}
    told |= {"times": [start.times for start in starts], "sensor_noise": [each.sensor_noise for each in scans]}
    severities = {name: getattr(registrations, f"severity_{name}") for name in SEVERITIES}
    judged = {"missed": ~causes.fitness_runs.any(axis=1), "state": truth.state, "dominant": truth.dominant}
    judged |= {"error": truth.error[:, ALL], "error_clean": truth.error[:, NONE]}
    judged |= {f"phi_{concept}": truth.phi[:, c] for c, concept in enumerate(CONCEPTS)}
    factors = {"error_factor": [each.error_factor for each in scans]}
    return pd.DataFrame({"sample": registrations.sample, **told, **severities, **judged, **factors})
