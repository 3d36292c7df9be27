"""Conditions of design ``additive``, with any estimator's covariance in place of Monte-Carlo's."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from gpca.alignment.features import estimate_normals
from gpca.alignment.methods.interface import Pair
from gpca.alignment.methods.registry import make_method
from gpca.pairs.dataset import Registrations
from gpca.pairs.judge import Judges
from gpca.process.progress import progress
from gpca.seeds import generator, seed_of
from gpca.uncertainty.designs import ADDITIVE_KNOBS, RegisteredRow
from gpca.uncertainty.estimators.analytic import sample
from gpca.uncertainty.estimators.interface import (
    POINT_TO_POINT,
    CovarianceEstimate,
    Example,
    Moved,
    RegisteredPair,
    describe,
    example,
)
from gpca.uncertainty.interventions import UNTOUCHED, KnobbedSource, Knobs
from gpca.uncertainty.settings import UncertaintySettings
from gpca.uncertainty.spread import divergence

MOVED: Moved = "observed"  # onto the model, as the paper's protocol has it
OBSERVED = (UNTOUCHED,)  # the condition of explainers that read the observed pair alone


@dataclass(frozen=True)
class Estimates:
    """One estimator's covariances of S registrations under K conditions."""

    covariance: np.ndarray  # (S, K, 6, 6), radians and diameters; NaN where there is none
    failure: np.ndarray  # (S, K) why there is none

    def failures(self, conditions: int) -> np.ndarray:
        """Return why one of the first `conditions` has no estimate (S,), empty where all have one."""
        return np.array([next(filter(None, row), "") for row in self.failure[:, :conditions]])

    def attach_to(self, registrations: Registrations, rows: np.ndarray, conditions: int, floor: float) -> Registrations:
        """Return rows of the S registrations with the outcomes of a design attached for explainers, at no cost."""
        covariance = self.covariance[rows, :conditions]
        outcomes = {"covariance": covariance, "uncertainty": divergence(covariance[:, :1], covariance, floor)}
        outcomes |= dict.fromkeys(("icp_calls", "seconds", "icp_seconds"), np.zeros(covariance.shape[:2]))
        subset = registrations.subset(rows)
        return replace(subset, attached={**subset.attached, **outcomes})


class KnobbedRegistrar:
    """Registers the rows of a source and seed by point-to-point ICP, under any setting of the knobs."""

    def __init__(self, registrations: Registrations, source: str, seed: int, settings: UncertaintySettings) -> None:
        self._registrations, self._axes, self._settings = registrations, (source, seed, "uncertainty"), settings
        self._register = make_method(POINT_TO_POINT)

    def under(self, row: int, settings_of_knobs: Sequence[Knobs]) -> Iterator[RegisteredPair]:
        """Yield the registration of a row under each setting."""
        registrations, settings = self._registrations, self._settings
        axes = (*self._axes, registrations.split[row], registrations.sample[row])
        random = generator(*axes, "clouds")
        points, target, T_init, _ = RegisteredRow(registrations, row).observed(settings.icp_points, random)
        source = KnobbedSource(points, random)
        normals = estimate_normals(target)
        for knobs in settings_of_knobs:
            pair = Pair(source.at(knobs), target, T_init, None, normals, seed_of(*axes, "estimates"))
            outcome = self._register(pair)
            deviation_6 = knobs.spread * settings.deviation_6()
            described = cache(lambda pair=pair, outcome=outcome: describe(pair, outcome, MOVED))
            yield RegisteredPair(pair, outcome, POINT_TO_POINT, deviation_6, described)

    def examples(self, rows: np.ndarray, judges: Judges) -> list[Example]:
        """Return rows as estimators learn from them."""
        examples = []
        for row in rows:
            [registered] = self.under(row, OBSERVED)
            T_true = self._registrations.T_target_source("true", row)
            starts, judge = self._settings.starts, judges.of(self._registrations, row)
            draw = partial(sample, registered, starts, *self._axes, "examples")
            examples.append(example(registered, T_true, judge, MOVED, draw, starts))
        return examples

    def estimates(
        self,
        rows: np.ndarray,
        estimators: Mapping[str, Callable[[RegisteredPair], CovarianceEstimate]],
        settings_of_knobs: Sequence[Knobs] = ADDITIVE_KNOBS,
    ) -> dict[str, Estimates]:
        """Return the covariances of the rows under each setting, by estimator."""
        shape = len(rows), len(settings_of_knobs)
        estimates = {
            name: Estimates(np.full((*shape, 6, 6), np.nan), np.full(shape, "", object)) for name in estimators
        }
        for s, row in enumerate(progress(rows, f"estimates of {self._axes[0]}, seed {self._axes[1]}")):
            for k, registered in enumerate(self.under(row, settings_of_knobs)):
                for name, estimate in estimators.items():
                    answer = estimate(registered)
                    if answer.covariance_6_6 is None:
                        estimates[name].failure[s, k] = answer.failure
                    else:
                        estimates[name].covariance[s, k] = answer.covariance_6_6
        return estimates
