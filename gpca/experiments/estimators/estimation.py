"""Lets every estimator say how uncertain the same registrations are, and measures its answers.

The registrations are test samples of the causes' track: objects that no training sample shows, and failures of every
kind. They are held against references of three kinds (:mod:`gpca.experiments.estimators.references`), and against the
error of the pose. Estimators that learn are trained three times: with samples of the same source, with those of
another source, and with the mild half of the own; the latter two show what a shift does to them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from gpca.errors import InputError
from gpca.experiments.estimators.covariances import ReferenceSamples, reference_name
from gpca.experiments.estimators.judging import judged
from gpca.experiments.estimators.settings import KINDS, MILD, OTHER_SOURCE, EstimatorPairSettings
from gpca.experiments.estimators.situations import EstimatedRow, Registering, Situations
from gpca.process.progress import progress
from gpca.uncertainty.estimators.interface import Estimate, Example, RegisteredPair
from gpca.uncertainty.estimators.registry import estimator_entry, make_estimator

if TYPE_CHECKING:
    import pandas as pd

Answers = Callable[[RegisteredPair], Estimate]


def try_estimators(
    situations: Situations,
    other: Situations | None,
    estimators: Mapping[str, Mapping],
    settings: EstimatorPairSettings,
) -> tuple[dict[str, pd.DataFrame], list[EstimatedRow]]:
    """Return for each reference and estimator a row per registration; and the registrations.

    Rows have the seconds of an estimate, with those of the descriptors that it reads, without those of learning. Those
    that are trained otherwise have rows of the method with the most registrations alone.

    Args:
        situations: with test samples.
        other: of another source, for learners; None where there is none.
        estimators: name -> settings.

    Raises:
        InputError: an unknown estimator, method or setting, or other objects or settings than those of the causes.
    """
    import pandas as pd

    records: dict[str, list[dict]] = {}
    cases = []
    for method, wanted in settings.methods.items():
        registering = Registering(situations, method, settings)
        trained = _trained(registering, estimators, settings)
        if method == most_tested(settings):
            trained |= _trained_otherwise(registering, other, estimators, settings)
        rows = spaced(situations.causes.rows("test"), wanted)
        if not len(rows):
            raise InputError(f"causes of {situations.source}", "have no test samples", "raise causes.test")
        for row in progress(rows, f"estimators on {situations.source}, seed {situations.seed}, {method}"):
            case = registering.case(row)
            cases.append(case)
            for kind in KINDS:
                answer = _of_reference(case, kind), case.references[kind].seconds
                records.setdefault(reference_name(kind), []).append(_row(case, *answer, settings.floor))
            for name, estimate in trained.items():
                started = perf_counter()
                estimated = estimate(case.registered)
                answer = estimated, perf_counter() - started
                records.setdefault(name, []).append(_row(case, *answer, settings.floor))
    return {name: pd.DataFrame(of_estimator) for name, of_estimator in records.items()}, cases


def reference_samples(cases: Sequence[EstimatedRow]) -> ReferenceSamples:
    """Return the references' results for these registrations, as their file holds them."""
    each = [(case, kind, case.references[kind].twists) for case in cases for kind in KINDS]
    return ReferenceSamples(
        sample=np.array([case.known["sample"] for case, _, _ in each]),
        method=np.array([case.known["method"] for case, _, _ in each]),
        kind=np.array([kind for _, kind, _ in each]),
        twists=np.concatenate([twists for *_, twists in each]).astype(np.float32),
        offsets=np.cumsum([0, *(len(twists) for *_, twists in each)], dtype=np.int64),
        true_twist=np.array([case.true_twist for case, _, _ in each]),
    )


def most_tested(settings: EstimatorPairSettings) -> str:
    """Return the method with the most registrations; of equals the first by name, as files keep no order of them."""
    return min(settings.methods, key=lambda method: (-settings.methods[method], method))


def _trained(
    registering: Registering, estimators: Mapping[str, Mapping], settings: EstimatorPairSettings
) -> dict[str, Answers]:
    """Return every estimator by name; those that learn are trained with training samples of the own source."""
    examples: list[Example] = []
    if _learners(estimators):
        train = registering.situations.causes.rows("train")
        examples = [registering.example(row) for row in spaced(train, settings.train)]
    return {name: make_estimator(name, entry, examples) for name, entry in estimators.items()}


def _trained_otherwise(
    registering: Registering,
    other: Situations | None,
    estimators: Mapping[str, Mapping],
    settings: EstimatorPairSettings,
) -> dict[str, Answers]:
    """Return what learns, by a name that says what it is trained with."""
    if not (learners := _learners(estimators)):
        return {}
    own = registering.situations
    rows = {MILD: (registering, mild(own, own.causes.rows("train")))}
    if other is not None:
        rows[OTHER_SOURCE] = Registering(other, registering.method, settings), other.causes.rows("train")
    examples = {shift: [by.example(row) for row in spaced(of, settings.train)] for shift, (by, of) in rows.items()}
    return {
        f"{name}_{shift}": make_estimator(name, estimators[name], of_shift)
        for name in learners
        for shift, of_shift in examples.items()
    }


def _learners(estimators: Mapping[str, Mapping]) -> list[str]:
    return [name for name in estimators if estimator_entry(name).learn]


def mild(situations: Situations, rows: np.ndarray) -> np.ndarray:
    """Return the half of the rows, in their order, whose strongest perturbation is weakest, in its range's maximum."""
    registrations, ranges = situations.causes.registrations, situations.drawn_by.severities
    strength_S = np.max(
        [
            registrations.severity_noise[rows] / ranges.noise[1],
            registrations.severity_rotation_rad[rows] / np.deg2rad(ranges.rotation_deg[1]),
            registrations.severity_translation[rows] / ranges.translation[1],
            registrations.severity_crop[rows] / ranges.crop[1],
        ],
        axis=0,
    )
    return rows[np.sort(np.argsort(strength_S, kind="stable")[: (len(rows) + 1) // 2])]


def spaced(rows: np.ndarray, wanted: int) -> np.ndarray:
    """Return a number of the rows, evenly spaced: states that are rare come last."""
    return rows[np.unique(np.linspace(0, len(rows) - 1, min(wanted, len(rows))).round().astype(int))]


def _row(case: EstimatedRow, answer: Estimate, seconds: float, floor: float) -> dict[str, object]:
    return judged(case, answer, floor) | {"seconds": seconds}


def _of_reference(case: EstimatedRow, kind: str) -> Estimate:
    covariance_6_6 = case.references[kind].covariance_6_6
    if covariance_6_6 is None:
        return Estimate(None, "too few of the reference's runs found a correspondence")
    return Estimate(covariance_6_6)
