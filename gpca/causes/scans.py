"""Registrations of scans to scans whose causes are measured (docs/appendix.md): real sensors, real overlap."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.features import estimate_normals
from gpca.alignment.pose_error import displacements
from gpca.causes.candidate import Candidate, Counterfactuals, Registrar, Unmeasurable
from gpca.causes.dataset import Causes
from gpca.causes.measuring import Measuring, RecordedPair, Subject, found_in, measure_cases
from gpca.causes.settings import FEWEST_POINTS, CauseSettings
from gpca.causes.truth import NONE
from gpca.io.frame import Frame
from gpca.objects.canonical import DRAWN
from gpca.pairs.perturbation import NOISE, OVERLAP, POSE
from gpca.process.progress import progress
from gpca.rigid import dots, inverse, inverses, rigid_motion, rotate, rotation_angle_rad, transform
from gpca.scans.pair import ScanPair, ScanSuccess
from gpca.scans.scene import ScanPairs
from gpca.seeds import generator
from gpca.uncertainty.spread import divergence

JUDGED_POINTS = 512  # of the common surface, over which an error is the root mean square
NORMAL_DEVIATION = 1.4826  # of a normal distribution, in median distances from its mean


@dataclass(frozen=True, kw_only=True)
class ScanCandidate(Candidate):
    """Two scans: the source is what was observed, the target is the model."""

    noisy_model: np.ndarray  # (P, 3) the target's points with the noise that is added
    model_common: np.ndarray  # rows of them on surface that the source has as well; ``seen`` has those of the source

    def reference(self, causes: tuple[int, ...]) -> np.ndarray:
        """Return the target's points with these of the applied causes."""
        points = self.noisy_model if NOISE in causes else self.model
        return points if OVERLAP in causes else points[self.model_common]

    def changing_reference(self, causes: tuple[int, ...]) -> tuple[int, ...]:
        """Return those of the causes that change the target: all but a pose error."""
        return tuple(cause for cause in causes if cause != POSE)


@dataclass(frozen=True)
class OverlapErrors:
    """Root mean square distances of the common points (N, 3) from where they truly lie, times a factor."""

    common: np.ndarray
    factor: float

    def __call__(self, T_observed_model_n: np.ndarray) -> np.ndarray:
        """Return the errors (n,) of poses (n, 4, 4) of the target in what was observed; the identity is right."""
        return self.factor * displacements(inverses(T_observed_model_n), self.common)


@dataclass(frozen=True)
class DrawnScans:
    """Some points of both scans, where they truly lie, in the target's frame about its middle, in its unit."""

    pair: ScanPair
    source: np.ndarray  # (N, 3)
    target: np.ndarray  # (P, 3)
    source_common: np.ndarray  # rows of either that lie on surface that the other scan has as well
    target_common: np.ndarray
    error_factor: float  # of distances, so that the limit of success is that of whole objects

    @classmethod
    def of(cls, pair: ScanPair, points: int, limit_m: float, failed: float, random: np.random.Generator) -> DrawnScans:
        """Draw points of each scan, at most so many; an RMSE of `limit_m` is to be an error of `failed`."""
        clouds = (pair.source_N_3, pair.target_M_3)
        rows_N, rows_M = (np.sort(random.permutation(len(cloud))[:points]) for cloud in clouds)
        center_3, unit_m = pair.middle_3, pair.unit_m
        return cls(
            pair=pair,
            source=(transform(pair.T_target_source, pair.source_N_3[rows_N].astype(np.float64)) - center_3) / unit_m,
            target=(pair.target_M_3[rows_M].astype(np.float64) - center_3) / unit_m,
            source_common=np.flatnonzero(pair.source_common_N[rows_N]),
            target_common=np.flatnonzero(pair.target_common_M[rows_M]),
            error_factor=failed * unit_m / limit_m,
        )

    @cached_property
    def errors(self) -> OverlapErrors:
        """The errors of poses."""
        return OverlapErrors(self.source[self.source_common][:JUDGED_POINTS], self.error_factor)

    @cached_property
    def sensor_noise(self) -> float:
        """The standard deviation of a measured point across its surface (:func:`sensor_noise_m`)."""
        return sensor_noise_m(self.pair) / self.pair.unit_m

    def candidate(self, T_target_source_init: np.ndarray, times: float, random: np.random.Generator) -> ScanCandidate:
        """Return the pair started at a pose in meters, with so many times the sensor's noise added to both scans."""
        noise = times * self.sensor_noise if times else 0.0
        jitter_N, jitter_M = (noise * random.normal(size=cloud.shape) for cloud in (self.source, self.target))
        T_init = motion_between(self.pair, self.pair.T_target_source, T_target_source_init)
        middle_3 = self.source.mean(axis=0)
        return ScanCandidate(
            applied=np.array([times > 0, True, True]),  # noise, pose, overlap
            model=self.target,
            clean=self.source,
            noisy=self.source + jitter_N,
            noisy_model=self.target + jitter_M,
            seen=self.source_common,
            model_common=self.target_common,
            kept=np.arange(len(self.source)),
            T_near=np.eye(4),
            T_init=T_init,
            severity={
                "noise": noise,
                "outliers": 0.0,
                "rotation_rad": rotation_angle_rad(T_init),
                "translation": float(np.linalg.norm(transform(T_init, middle_3) - middle_3)),
                "crop": 1 - self.pair.overlap,
            },
        )


def motion_between(pair: ScanPair, T_target_source_from: np.ndarray, T_target_source_to: np.ndarray) -> np.ndarray:
    """Return the motion (4×4) of the source between two poses in meters, in the frame in which a pair is registered."""
    T_m, center_3 = T_target_source_to @ inverse(T_target_source_from), pair.middle_3
    # Poses of data sets are rounded, so that the last row of a product may not be exact.
    return rigid_motion(T_m[:3, :3], (rotate(T_m, center_3) + T_m[:3, 3] - center_3) / pair.unit_m)


def sensor_noise_m(pair: ScanPair) -> float:
    """Return an upper bound of the standard deviation, in meters, of measured points across the surface."""
    common = transform(pair.T_target_source, pair.source_N_3[pair.source_common_N].astype(np.float64))
    if not len(common):
        return 0.0
    target = pair.target_M_3.astype(np.float64)
    rows = cKDTree(target).query(common)[1]
    across = dots(common - target[rows], estimate_normals(target)[rows])
    return float(NORMAL_DEVIATION * np.median(np.abs(across)) / np.sqrt(2))


LADDER, GLOBAL = KINDS = ("ladder", "global")


@dataclass(frozen=True)
class ScanStart:
    """Where a registration of a pair begins, and with how much more noise."""

    pair: int  # its number
    kind: str  # ``ladder``: the true pose, disturbed by a rung; ``global``: the pose that a global method found
    init_from: str  # the rung or the method
    T_target_source: np.ndarray  # 4×4, meters
    times: float = 0.0  # how much noise is added, in units of the sensor's; 0 where the registration is natural
    found: tuple[np.ndarray, ...] = ()  # what global methods found of the pair, 4×4, meters: an observer may know it


def measure_scans(
    pairs: ScanPairs,
    starts: Sequence[ScanStart],
    source: str,
    seed: int,
    settings: CauseSettings,
    success: ScanSuccess,
    points: int,
) -> tuple[Causes, Frame]:
    """Measure the causes of registrations, of `points` of each scan at most; return them and a row for each."""
    import pandas as pd

    drawn: dict[int, DrawnScans] = {}
    limits: list[float] = []
    for k in progress(sorted({start.pair for start in starts}), f"clean pairs of {source}, seed {seed}"):
        pair = pairs[k]
        randoms = (generator(source, seed, "scan causes", pair.name, part) for part in ("points", "other points"))
        limit_m, failed = success.limit_m(pair), settings.limits.failed
        scans, others = (DrawnScans.of(pair, points, limit_m, failed, random) for random in randoms)
        try:
            limits.append(_clean_uncertainty(scans, others, (source, seed), settings))
            drawn[k] = scans
        except Unmeasurable as fault:
            print(f"causes of {source}: pair {pair.name} is skipped: {fault}", file=sys.stderr)
    measuring = Measuring(settings, float(np.quantile(limits, settings.limits.clean)) if limits else 0.0)

    def case(number: int) -> RecordedPair:
        start = starts[number]
        scans = drawn[start.pair]
        pair = scans.pair
        axes = (source, seed, "scan causes", pair.name, start.init_from)  # the same starts, whatever noise is added

        def candidate() -> tuple[Candidate, Subject]:
            random = generator(*axes, "noise", start.times)
            # The pair stands in the place of an object, and its scene in that of a family.
            about = pair.unit_m, scans.target, False, scans.errors, pair.cluster, DRAWN
            subject = Subject(start.pair, pair.name, *about)
            return scans.candidate(start.T_target_source, start.times, random), subject

        return RecordedPair(number, number, f"pair {pair.name} ({start.kind}, {start.init_from})", axes, candidate)

    numbers = progress(range(len(starts)), f"causes of {source}, seed {seed}")
    cases = (case(number) for number in numbers if starts[number].pair in drawn)
    nothing = ("no registration of the scans can be measured", "check their poses")
    causes = measure_cases(cases, measuring, (source, seed), nothing)
    sample_S, (severities, found) = causes.registrations.sample, found_in(causes)
    measured = [starts[number] for number in sample_S]
    scans_S = [drawn[start.pair] for start in measured]
    columns = {"sample": sample_S, "pair": [each.pair.name for each in scans_S]}
    columns |= {"cluster": causes.registrations.cluster}
    columns |= {name: [getattr(each.pair, name) for each in scans_S] for name in ("kind", "overlap")}
    columns |= {"start": [start.kind for start in measured], "init_from": [start.init_from for start in measured]}
    columns |= {"times": [start.times for start in measured], "sensor_noise": [each.sensor_noise for each in scans_S]}

    def one_sided(number: int) -> str:
        """Return the dominant cause where overlap is completed by cropping the source alone."""
        each = case(number)
        candidate, subject = each.make()
        assert isinstance(candidate, ScanCandidate)
        whole = Registrar(replace(candidate, model_common=np.arange(len(candidate.model))), settings, misses=True)
        try:
            return str(measuring.truth(measuring.counterfactuals(whole, subject, each.axes, "starts")).dominant[0])
        except Unmeasurable:
            return ""

    is_natural = {number: starts[number].kind == GLOBAL and not starts[number].times for number in sample_S.tolist()}
    found["dominant_one_sided"] = [one_sided(number) if natural else "" for number, natural in is_natural.items()]
    found["error_factor"] = [each.error_factor for each in scans_S]
    return causes, pd.DataFrame({**columns, **severities, **found})


def _clean_uncertainty(scans: DrawnScans, others: DrawnScans, axes: tuple, settings: CauseSettings) -> float:
    """Return the divergence between two registrations of a pair that nothing is wrong with: of other points of both."""
    pair = scans.pair
    xi_n_6 = generator(*axes, "scan causes", pair.name, "clean").normal(size=(settings.starts, 6))
    covariances = []
    for each in (scans, others):
        if min(len(each.source_common), len(each.target_common)) < FEWEST_POINTS:
            raise Unmeasurable("too few of its points lie on surface that both scans see")
        candidate = each.candidate(pair.T_target_source, 0.0, generator(*axes, "nothing is drawn"))
        registrar = Registrar(candidate, settings, misses=True)
        measured = Counterfactuals(registrar, each.errors, xi_n_6 * settings.deviation_6(), settings)
        covariances.append(measured.covariance(NONE))
    return float(divergence(covariances[0], covariances[1], settings.floor))
