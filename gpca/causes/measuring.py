"""Measures candidates: the objects they show, clean pairs, counterfactuals, truth, and the explainer's view."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gpca.alignment.pose_error import PoseErrors
from gpca.causes.candidate import Candidate, Counterfactuals, Registrar, Unmeasurable, draw_candidate, redrawn
from gpca.causes.dataset import Causes
from gpca.causes.settings import CauseSettings
from gpca.causes.truth import ALL, NONE, SUBSETS, Truth, capped
from gpca.errors import InputError
from gpca.io.files import SPLITS, Axes
from gpca.objects.bop import find_symmetries
from gpca.objects.canonical import ObjectClouds, drawn, unseen
from gpca.pairs.perturbation import CONCEPTS, SEVERITIES
from gpca.pairs.synthesis import as_registrations
from gpca.process.progress import progress
from gpca.rigid import inverse, scale_translation, transform
from gpca.seeds import generator
from gpca.uncertainty.spread import divergence

JUDGED_POINTS = 256  # of the model, over which an error is the mean
# Of an object's clean pairs. Where more are off, hardly any of its candidates would be kept; of the others, those whose
# own clean pair is off are refused one by one. Half would be a matter of chance for mugs, at so few pairs each.
MOST_FAILING = 0.9
MORE = 3  # times as many pairs again before an object is left out: a few may all be off by chance
FEWEST_FAMILIES = 2  # one for training, one for testing; intervals over objects need more


@dataclass(frozen=True)
class Subject:
    """One object, or a pair of scans in its place."""

    index: int  # its number in the file of the objects
    name: str
    diameter_m: float
    surface: np.ndarray  # (N, 3) its points, in diameters
    symmetric: bool
    errors: Callable[[np.ndarray], np.ndarray]  # of poses (n, 4, 4) of it, in diameters (n,); the identity is right
    family: str
    fold: int

    @classmethod
    def of(cls, objects: ObjectClouds, index: int, symmetric: bool) -> Subject:
        """Return an object of the file."""
        diameter_m = float(objects.diameters_m[index])
        surface = objects.points(index).astype(np.float64) / diameter_m
        errors = PoseErrors(surface, JUDGED_POINTS, symmetric)
        name, family, fold = str(objects.names[index]), str(objects.families[index]), int(objects.folds[index])
        return cls(index, name, diameter_m, surface, symmetric, errors, family, fold)


def read_subjects(objects: ObjectClouds) -> list[Subject]:
    """Return the objects, with errors that respect their symmetries."""
    sizes = enumerate(objects.diameters_m.tolist())
    return [Subject.of(objects, i, bool(find_symmetries(objects.points(i), size_m))) for i, size_m in sizes]


def split_by_object(
    subjects: list[Subject], source: str, seed: int, settings: CauseSettings
) -> dict[str, list[Subject]]:
    """Return the subjects of each split, families undivided; InputError for fewer than two of these."""
    family_N = np.array([subject.family for subject in subjects])
    if len(set(family_N.tolist())) < FEWEST_FAMILIES:
        fault = "has objects of one family alone, which cannot be split into training and test objects"
        raise InputError(f"causes of {source}", fault, "give objects of at least two families of shapes")
    is_test_N = unseen(np.array([subject.fold for subject in subjects]), seed)
    if is_test_N is None:
        is_test_N = drawn(family_N, settings.test_objects, source, seed, "causes", "objects")
    halves = ((split, np.flatnonzero(is_test_N == (split == "test"))) for split in SPLITS)
    return {split: [subjects[row] for row in rows] for split, rows in halves}


def measure_clean_pairs(
    subjects: list[Subject], source: str, seed: int, settings: CauseSettings
) -> tuple[list[Subject], float]:
    """Return the subjects, without those of which nearly all clean pairs are off, and the limit of the uncertainty.

    It is a quantile of the divergence between two clean pairs of one object, as large, from the same starts.
    """
    off = f"an error of at least {100 * settings.limits.nominal:g} % of the diameter or cannot be registered"
    nominal, count = settings.limits.nominal, -(-settings.clean_pairs // len(subjects))

    def most_are_off(pairs: list[tuple[float, float] | None]) -> bool:
        right = sum(pair is not None and pair[0] < nominal for pair in pairs)
        return len(pairs) - right > MOST_FAILING * len(pairs)

    left, uncertainties = [], []
    for subject in progress(subjects, f"clean pairs of {source}, seed {seed}"):
        measured = [_clean_pair(subject, source, seed, number, settings) for number in range(count)]
        if most_are_off(measured) and not settings.shares.geometry:
            more = [_clean_pair(subject, source, seed, count + number, settings) for number in range(MORE * count)]
            if most_are_off(looked_at := measured + more):
                fault = f"nearly all of {len(looked_at)} clean pairs have {off}"
                print(f"causes of {source}: object '{subject.name}' is skipped: {fault}", file=sys.stderr)
                continue
        left.append(subject)
        uncertainties += [pair[1] for pair in measured if pair is not None]
    if not uncertainties:
        fault = f"nearly all clean pairs of every object have {off}"
        raise InputError(f"causes of {source}", fault, "raise causes.limits.nominal or causes.points")
    return left, float(np.quantile(uncertainties, settings.limits.clean))


def _clean_pair(
    subject: Subject, source: str, seed: int, number: int, settings: CauseSettings
) -> tuple[float, float] | None:
    random = generator(source, seed, "causes", "clean", subject.name, number)
    first = draw_candidate(subject.surface, np.zeros(len(CONCEPTS), bool), settings, random)
    second = redrawn(first, subject.surface, random)
    xi_n_6 = random.normal(size=(settings.starts, 6)) * settings.deviation_6()
    runs = [Counterfactuals(Registrar(pair, settings), subject.errors, xi_n_6, settings) for pair in (first, second)]
    try:
        uncertainty = divergence(runs[0].covariance(NONE), runs[1].covariance(NONE), settings.floor)
        return runs[0].error(NONE), float(uncertainty)
    except Unmeasurable:
        return None


@dataclass(frozen=True)
class Measuring:
    """How candidates are measured; the limit is that of the uncertainty of a nominal registration, nats."""

    settings: CauseSettings
    uncertainty_limit: float

    def counterfactuals(self, registrar: Registrar, subject: Subject, axes: tuple, starts: str) -> Counterfactuals:
        """Return the counterfactuals from starts that axes and name draw."""
        return Counterfactuals(registrar, subject.errors, self._twists(axes, starts), self.settings)

    def truth(self, measured: Counterfactuals, subsets: Sequence[int] = range(len(SUBSETS))) -> Truth:
        """Return the truth of one candidate, with these in the places of all eight subsets."""
        error_1_8 = np.array([[measured.error(subset) for subset in subsets]])
        uncertainty_1_8 = np.array([[measured.uncertainty(subset) for subset in subsets]])
        limits = self.settings.limits
        return Truth(error_1_8, uncertainty_1_8, limits.nominal, limits.failed, limits.cause, self.uncertainty_limit)

    def observed(self, registrar: Registrar, subject: Subject, axes: tuple, most: int | None = None) -> dict[str, Any]:
        """Return the explainer's view of a candidate, by so many runs at most, and what was applied to it."""
        candidate = registrar.candidate
        xi_n_6 = self._twists(axes, "observed starts")[:most]
        xi_n_6[0] = 0
        causes = candidate.present
        runs = registrar.run(causes, xi_n_6)
        # The source is what was observed, in the frame of the initial pose.
        T_true = inverse(candidate.start(causes))
        poses_n_m = [scale_translation(T @ T_true, subject.diameter_m) for T in runs.T_target_source_n]
        return {
            "object_index": subject.index,
            "object_name": subject.name,
            "diameter_m": subject.diameter_m,
            "cluster": subject.family,
            "fold": subject.fold,
            "cloud": transform(runs.T_target_source_n[0], candidate.observed(causes)).astype(np.float32),
            "target": candidate.reference(causes).astype(np.float32),
            "T_target_source_true": scale_translation(T_true, subject.diameter_m),
            "T_target_source_init": np.eye(4),
            "T_target_source_icp": poses_n_m[0],
            "fitness": runs.fitness_n[0],
            "inlier_rmse": runs.inlier_rmse_n[0],
            "icp_seconds": runs.icp_seconds,
            **{f"severity_{name}": value for name, value in candidate.severity.items()},
            "applied": candidate.applied,
            "symmetric": subject.symmetric,
            "T_target_source_runs": np.stack(poses_n_m),
            "fitness_runs": runs.fitness_n,
            "inlier_rmse_runs": runs.inlier_rmse_n,
            "error_shown": capped(subject.errors(inverse(runs.T_target_source_n[0])[None]))[0],
        }

    def _twists(self, axes: tuple, starts: str) -> np.ndarray:
        shape = (self.settings.starts, 6)
        return generator(*axes, starts).normal(size=shape) * self.settings.deviation_6()


@dataclass(frozen=True)
class RecordedPair:
    """A registration to be measured that was not drawn: one in a depth frame, or one of two scans."""

    sample: int  # number of its row
    candidate: int  # and of what it shows
    name: str  # for messages
    axes: tuple  # name its random numbers
    make: Callable[[], tuple[Candidate, Subject]]  # what stands for its object; may raise `Unmeasurable`


def measure_cases(cases: Iterable[RecordedPair], measuring: Measuring, axes: Axes, nothing: tuple[str, str]) -> Causes:
    """Measure test samples from two sets of starts; what has no truth is left out, and named on stderr."""
    records: list[dict[str, Any]] = []
    for case in cases:
        try:
            candidate, subject = case.make()
            registrar = Registrar(candidate, measuring.settings, misses=True)
            record: dict[str, Any] = {"sample": case.sample, "split": "test", "candidate": case.candidate}
            for name, starts in (("truth", "starts"), ("again", "other starts")):
                record[name] = measuring.truth(measuring.counterfactuals(registrar, subject, case.axes, starts))
            records.append(record | measuring.observed(registrar, subject, case.axes))
        except Unmeasurable as fault:
            print(f"causes of {axes[0]}: {case.name} is skipped: {fault}", file=sys.stderr)
    if not records:
        raise InputError(f"causes of {axes[0]}", *nothing)
    return as_causes(records, axes)[0]


def found_in(causes: Causes) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the severities and what was found of each row, as columns of a table of samples."""
    truth = causes.truth
    severities = {name: getattr(causes.registrations, f"severity_{name}") for name in SEVERITIES}
    found = {"missed": ~causes.fitness_runs.any(axis=1), "state": truth.state, "dominant": truth.dominant}
    found |= {"error": truth.error[:, ALL], "error_clean": truth.error[:, NONE]}
    found |= {f"phi_{concept}": truth.phi[:, c] for c, concept in enumerate(CONCEPTS)}
    return severities, found


def as_causes(records: list[dict[str, Any]], axes: Axes) -> tuple[Causes, np.ndarray]:
    """Return rows as registrations with their truth, and the seconds (S,) that ICP took for each."""

    def joined(name: str) -> Truth:
        truths = [record[name] for record in records if name in record]
        error_S_8 = np.array([each.error[0] for each in truths]).reshape(-1, len(SUBSETS))
        uncertainty_S_8 = np.array([each.uncertainty[0] for each in truths]).reshape(-1, len(SUBSETS))
        return replace(records[0]["truth"], error=error_S_8, uncertainty=uncertainty_S_8)

    truth = joined("truth")
    for record, concept in zip(records, np.array(CONCEPTS)[truth.phi.argmax(axis=1)], strict=True):
        record["concept"] = concept
    registrations, icp_seconds_S = as_registrations(records, axes)
    columns: dict[str, Any] = {name: np.array([record[name] for record in records]) for name in Causes.array_fields()}
    return Causes(registrations=registrations, **columns, truth=truth, truth_again=joined("again")), icp_seconds_S
