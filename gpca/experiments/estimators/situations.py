"""Rows of the causes as they come to the estimators: registered by one method, and able to be drawn again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from time import perf_counter

import numpy as np

from gpca.alignment.methods.interface import Pair
from gpca.alignment.methods.registry import make_method
from gpca.alignment.rigid import inverse
from gpca.causes.candidate import drawn_again
from gpca.causes.dataset import Causes
from gpca.causes.descriptors import observed_pair
from gpca.causes.settings import CauseSettings
from gpca.experiments.estimators.references import Redraws, Reference, draw_twists
from gpca.experiments.estimators.settings import KINDS, EstimatorPairSettings, Kind
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.judge import Judges
from gpca.seeds import generator, seed_of
from gpca.uncertainty.estimators.examples import Moved, describe, example, true_twist
from gpca.uncertainty.estimators.interface import Example, FailedEstimate, RegisteredPair

MOVED: Moved = "model"  # onto the observed cloud, as the causes' track has it


@dataclass(frozen=True)
class Situations:
    """Registrations of one source and seed with measured causes, and what it takes to draw them again.

    Attributes:
        drawn_by: the settings that the causes were drawn with.
        objects, judges: of the source.
    """

    source: str
    seed: int
    causes: Causes
    drawn_by: CauseSettings
    objects: ObjectClouds
    judges: Judges


@dataclass(frozen=True)
class EstimatedRow:
    """A test registration by one method.

    Attributes:
        known: the columns of every row about it: sample, object, method, errors.
        registered: the input of an estimator.
        true_twist: (6,) of the true pose about that of the registration, the symmetric one that is nearest.
        references: by their kind.
    """

    known: dict[str, object]
    registered: RegisteredPair
    true_twist: np.ndarray
    references: Mapping[str, Reference]


class Registering:
    """Registers rows of the situations by one method."""

    def __init__(self, situations: Situations, method: str, settings: EstimatorPairSettings) -> None:
        self.situations, self.method, self._settings = situations, method, settings
        self._axes = (situations.source, situations.seed, "estimators", method)
        self._register = make_method(method)
        self._examples: dict[int, Example] = {}

    def case(self, row: int) -> EstimatedRow:
        """Return a test registration with the references."""
        registrations, judge = (
            self.situations.causes.registrations,
            self.situations.judges.of(self.situations.causes.registrations, row),
        )
        registered, T_true = self._registered(row)
        # ADD moves the object, which is the source here: errors are those of the inverse pose.
        errors = judge(inverse(registered.T_target_source), inverse(T_true))
        known = {
            "sample": registrations.sample[row],
            "object": registrations.object_name[row],
            "cluster": registrations.cluster[row],
            "method": self.method,
            "add_relative": errors["add_relative"],
            "failed": bool(errors["add_relative"] >= self._settings.failed or not registered.outcome.fitness),
            "inlier_rmse": registered.outcome.inlier_rmse,
            "fitness": registered.outcome.fitness,
        }
        redraws = self._redraws(row, T_true)
        references: dict[str, Reference] = {kind: self._reference(kind, registered, redraws) for kind in KINDS}
        return EstimatedRow(known, registered, true_twist(registered, T_true, judge, MOVED), references)

    def example(self, row: int) -> Example:
        """Return a training registration with the results of a few registrations of other data from other starts."""
        if row not in self._examples:
            registered, T_true = self._registered(row)
            judge = self.situations.judges.of(self.situations.causes.registrations, row)
            redraws, runs = self._redraws(row, T_true), self._settings.train_starts
            axes = (*self._axes, "examples")
            draw = partial(draw_twists, "all", registered, redraws, runs, *axes)
            self._examples[row] = example(registered, T_true, judge, MOVED, draw, runs)
        return self._examples[row]

    def _registered(self, row: int) -> tuple[RegisteredPair, np.ndarray]:
        """Return a registration of the model, the source, to the observed cloud, and the true pose.

        The target's frame is the one in which the causes' track has put the observed cloud: near the model's.
        """
        observed = observed_pair(self.situations.causes, row, *self._axes)
        random = generator(*observed.axes, "clouds")
        points = self._settings.points
        source, target = (
            cloud[random.permutation(len(cloud))[:points]] for cloud in (observed.model, observed.observed)
        )
        pair = Pair(source, target, inverse(observed.T_init), seed=seed_of(*observed.axes, "draws")).with_normals()
        registrations = self.situations.causes.registrations
        T_icp, T_true = (registrations.T_target_source(which, row) for which in ("icp", "true"))
        outcome = self._register(pair)
        deviation_6 = self._settings.deviation_6()
        registered = RegisteredPair(pair, outcome, self.method, deviation_6, lambda: describe(pair, outcome, MOVED))
        return registered, T_icp @ inverse(T_true)

    def _redraws(self, row: int, T_true: np.ndarray) -> Redraws:
        """Return what draws the clouds of a row again. The true pose takes what was observed to the target's frame.

        Raises:
            InputError: the settings, or the objects, are not those that the row was drawn with.
        """
        of = self.situations
        candidate, surface = drawn_again(of.objects, of.causes, row, of.source, of.seed, of.drawn_by)
        return Redraws(candidate, surface, T_true, self._settings.points)

    def _reference(self, kind: Kind, registered: RegisteredPair, redraws: Redraws) -> Reference:
        started = perf_counter()
        try:
            twists_n_6 = draw_twists(kind, registered, redraws, self._settings.repeats, *self._axes, "reference")
        except FailedEstimate:
            return Reference(seconds=perf_counter() - started)
        return Reference(twists_n_6, perf_counter() - started)
