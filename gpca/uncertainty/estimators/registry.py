"""Every estimator of a pose's covariance by name, one or a few per file of this folder."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import cast

import numpy as np

from gpca.errors import InputError
from gpca.io.arrays import require_numbers
from gpca.process.registry import Registry
from gpca.settings import require_arguments
from gpca.uncertainty.estimators.interface import (
    CovarianceEstimate,
    Estimator,
    EstimatorEntry,
    Example,
    FailedEstimate,
    RegisteredPair,
)

REGISTRY: Registry[EstimatorEntry] = Registry("estimator", __package__, "ESTIMATORS", outside=EstimatorEntry)
estimators, estimator_entry, estimator_module = REGISTRY.entries, REGISTRY.entry, REGISTRY.module


def require_estimator_settings(name: str, settings: Mapping[str, object]) -> None:
    entry = estimator_entry(name)
    require_arguments(f"estimator '{name}'", cast("Callable", entry.learn or entry.estimate), 1, settings)


def make_estimator(
    name: str, settings: Mapping[str, object] | None = None, examples: Sequence[Example] = ()
) -> Callable[[RegisteredPair], CovarianceEstimate]:
    """Return an estimator as a function from registered pairs to estimates; one that learns needs examples."""
    settings = dict(settings or {})
    require_estimator_settings(name, settings)
    entry = estimator_entry(name)
    estimate = cast("Estimator", partial(entry.estimate, **settings) if entry.estimate else None)
    if entry.learn is not None:
        if not examples:
            known = ", ".join(other for other, each in estimators().items() if each.learn is None)
            fault = "learns from registrations of training objects, and there are none here"
            raise InputError(f"estimator '{name}'", fault, f"choose one of {known}")
        try:
            estimate = entry.learn(examples, **settings)
        except FailedEstimate as failure:
            failed = CovarianceEstimate(None, str(failure))
            return lambda registered: failed

    def estimate_or_failure(registered: RegisteredPair) -> CovarianceEstimate:
        if registered.outcome.fitness == 0:
            return CovarianceEstimate(None, registered.outcome.failure or "no source point is near the target")
        try:
            subject = f"estimator '{name}': its covariance"
            covariance_6_6 = require_numbers(estimate(registered), (6, 6), subject, finite=False)
            if not np.isfinite(covariance_6_6).all():
                raise FailedEstimate("the covariance is not finite")
        except FailedEstimate as failure:
            return CovarianceEstimate(None, str(failure))
        return CovarianceEstimate((covariance_6_6 + covariance_6_6.T) / 2)

    return estimate_or_failure
