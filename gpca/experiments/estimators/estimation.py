"""Lets every estimator say how uncertain the same registrations are, and measures its answers.

The registrations are test samples of the causes' track: objects that no training sample shows, and failures of every
kind. They are held against a reference, Monte-Carlo from many starts, and against the error of the pose.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from gpca.alignment.methods.interface import Pair
from gpca.alignment.methods.registry import make_method
from gpca.alignment.rigid import inverse, transform
from gpca.alignment.twist import point_jacobians
from gpca.causes.dataset import Causes
from gpca.errors import InputError
from gpca.experiments.estimators.covariances import JUDGED, REFERENCE, ReferenceSamples, covariance_columns
from gpca.experiments.estimators.examples import Moved, describe, example, true_twist
from gpca.experiments.estimators.settings import EstimatorPairSettings
from gpca.experiments.judge import Judges
from gpca.features.pair import observed_pair
from gpca.process.progress import progress
from gpca.seeds import generator, seed_of
from gpca.uncertainty.estimators.interface import Estimate, Example, FailedEstimate, RegisteredPair
from gpca.uncertainty.estimators.monte_carlo import sample
from gpca.uncertainty.estimators.registry import estimator_entry, make_estimator
from gpca.uncertainty.spread import divergence

if TYPE_CHECKING:
    import pandas as pd

MOVED: Moved = "model"  # onto the observed cloud, as the causes' track has it


@dataclass(frozen=True)
class EstimatedRow:
    """A test registration by one method.

    Attributes:
        known: the columns of every row about it: sample, object, method, errors.
        registered: the input of an estimator.
        true_twist: (6,) of the true pose about that of the registration, the symmetric one that is nearest.
        reference_twists: (n, 6) of the reference's results; none where it failed.
        reference_seconds: that they took.
    """

    known: dict[str, object]
    registered: RegisteredPair
    true_twist: np.ndarray
    reference_twists: np.ndarray
    reference_seconds: float


def try_estimators(
    causes: Causes,
    judges: Judges,
    source: str,
    seed: int,
    estimators: Mapping[str, Mapping],
    settings: EstimatorPairSettings,
) -> tuple[dict[str, pd.DataFrame], list[EstimatedRow]]:
    """Return for each estimator, and for the reference, a row per registration; and the registrations.

    Rows have the seconds of an estimate, with those of the descriptors that it reads, without those of learning.

    Args:
        causes: with test samples.
        judges: of their objects.
        estimators: name -> settings.

    Raises:
        InputError: an unknown estimator, method or setting, or other objects than those that were registered.
    """
    import pandas as pd

    records: dict[str, list[dict]] = {name: [] for name in (REFERENCE, *estimators)}
    cases = []
    for method, wanted in settings.methods.items():
        axes = (source, seed, "estimators", method)
        make = _Maker(causes, judges, method, axes, settings)
        learning = any(estimator_entry(name).learn for name in estimators)
        examples = [make.example(row) for row in _spaced(causes.rows("train"), settings.train)] if learning else []
        made = {name: make_estimator(name, entry, examples) for name, entry in estimators.items()}
        rows = _spaced(causes.rows("test"), wanted)
        if not len(rows):
            raise InputError(f"causes of {source}", "have no test samples", "raise causes.test")
        for row in progress(rows, f"estimators on {source}, seed {seed}, {method}"):
            case = make.case(row)
            if row == rows[0]:
                for estimate in made.values():
                    estimate(case.registered)  # what is loaded or compiled at the first call
            cases.append(case)
            reference = _reference(case)
            of_reference = _judged(case, reference, reference, settings.floor)
            records[REFERENCE].append(of_reference | {"seconds": case.reference_seconds})
            for name, estimate in made.items():
                started = perf_counter()
                answer = estimate(case.registered)
                seconds = perf_counter() - started
                records[name].append(_judged(case, answer, reference, settings.floor) | {"seconds": seconds})
    return {name: pd.DataFrame(of_estimator) for name, of_estimator in records.items()}, cases


def reference_samples(cases: Sequence[EstimatedRow]) -> ReferenceSamples:
    """Return the reference's results for these registrations, as its file holds them."""
    return ReferenceSamples(
        sample=np.array([case.known["sample"] for case in cases]),
        method=np.array([case.known["method"] for case in cases]),
        twists=np.concatenate([case.reference_twists for case in cases]).astype(np.float32),
        offsets=np.cumsum([0, *(len(case.reference_twists) for case in cases)], dtype=np.int64),
        true_twist=np.array([case.true_twist for case in cases]),
    )


class _Maker:
    """Registers rows of the causes by one method, as they come to the estimators."""

    def __init__(
        self, causes: Causes, judges: Judges, method: str, axes: tuple, settings: EstimatorPairSettings
    ) -> None:
        self._causes, self._judges, self._method, self._axes = causes, judges, method, axes
        self._settings = settings
        self._register = make_method(method)

    def case(self, row: int) -> EstimatedRow:
        """Return a test registration with the reference's results."""
        registered, T_true = self._registered(row)
        registrations, judge = self._causes.registrations, self._judges.of(self._causes.registrations, row)
        # ADD moves the object, which is the source here: errors are those of the inverse pose.
        errors = judge(inverse(registered.T_target_source), inverse(T_true))
        started = perf_counter()
        try:
            twists_n_6 = sample(registered, self._settings.starts, *self._axes, "reference")
        except FailedEstimate:
            twists_n_6 = np.empty((0, 6))
        seconds = perf_counter() - started
        known = {
            "sample": registrations.sample[row],
            "object": registrations.object_name[row],
            "method": self._method,
            "add_relative": errors["add_relative"],
            "failed": bool(errors["add_relative"] >= self._settings.failed or not registered.outcome.fitness),
        }
        return EstimatedRow(known, registered, true_twist(registered, T_true, judge, MOVED), twists_n_6, seconds)

    def example(self, row: int) -> Example:
        """Return a training registration with the results of a few starts."""
        registered, T_true = self._registered(row)
        judge = self._judges.of(self._causes.registrations, row)
        return example(registered, T_true, judge, MOVED, self._settings.train_starts, *self._axes)

    def _registered(self, row: int) -> tuple[RegisteredPair, np.ndarray]:
        """Return a registration of the model, the source, to the observed cloud, and the true pose.

        The target's frame is the one in which the causes' track has put the observed cloud: near the model's.
        """
        observed = observed_pair(self._causes, row, *self._axes)
        random = generator(*observed.axes, "clouds")
        points = self._settings.points
        source, target = (
            cloud[random.permutation(len(cloud))[:points]] for cloud in (observed.model, observed.observed)
        )
        pair = Pair(source, target, inverse(observed.T_init), seed=seed_of(*observed.axes, "draws")).with_normals()
        registrations = self._causes.registrations
        T_icp, T_true = (registrations.T_target_source(which, row) for which in ("icp", "true"))
        outcome = self._register(pair)
        deviation_6 = self._settings.deviation_6()
        registered = RegisteredPair(pair, outcome, self._method, deviation_6, lambda: describe(pair, outcome, MOVED))
        return registered, T_icp @ inverse(T_true)


def mahalanobis(true_twist_6: np.ndarray, covariance_6_6: np.ndarray, floor: float) -> float:
    """Return eᵀ (Σ + εI)⁻¹ e, of χ² with six degrees where the covariance is right."""
    return float(true_twist_6 @ np.linalg.solve(covariance_6_6 + floor * np.eye(6), true_twist_6))


def predicted_spread(points_N_3: np.ndarray, covariance_6_6: np.ndarray) -> float:
    """Return the root mean square distance by which points would move: √ mean tr(J Σ Jᵀ), in their unit."""
    jacobians_N_3_6 = point_jacobians(points_N_3)
    squares = np.einsum("nij,jk,nik->n", jacobians_N_3_6, covariance_6_6, jacobians_N_3_6)
    return float(np.sqrt(max(squares.mean(), 0.0)))


def _judged(case: EstimatedRow, answer: Estimate, reference: Estimate, floor: float) -> dict[str, object]:
    """Return the row of an estimate; numbers that it lacks are NaN."""
    row = {**case.known, "failure": answer.failure}
    numbers = dict.fromkeys(JUDGED, np.nan)
    if answer.covariance_6_6 is not None:
        sigma_6_6, e_6 = answer.covariance_6_6, case.true_twist
        numbers["error_ratio"] = float(e_6 @ e_6 / np.trace(sigma_6_6 + floor * np.eye(6)))
        numbers["mahalanobis"] = mahalanobis(e_6, sigma_6_6, floor)
        points = transform(case.registered.T_target_source, case.registered.pair.source)
        numbers["spread"] = predicted_spread(points, sigma_6_6)
        if reference.covariance_6_6 is not None:
            for name, block in (("kl_rotation", slice(0, 3)), ("kl_translation", slice(3, 6))):
                expected_3_3, estimated_3_3 = reference.covariance_6_6[block, block], sigma_6_6[block, block]
                numbers[name] = float(divergence(expected_3_3, estimated_3_3, floor))
    return row | numbers | covariance_columns(answer.covariance_6_6)


def _reference(case: EstimatedRow) -> Estimate:
    if not len(case.reference_twists):
        return Estimate(None, "too few of the reference's runs found a correspondence")
    return Estimate(np.cov(case.reference_twists, rowvar=False))


def _spaced(rows: np.ndarray, wanted: int) -> np.ndarray:
    """Return a number of the rows, evenly spaced: states that are rare come last."""
    return rows[np.unique(np.linspace(0, len(rows) - 1, min(wanted, len(rows))).round().astype(int))]
