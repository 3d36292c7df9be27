"""Every estimator of a pose's covariance by name, one or a few per file of this folder."""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module

import numpy as np

import gpca.uncertainty.estimators as folder
from gpca.errors import InputError
from gpca.settings import require_arguments
from gpca.uncertainty.estimators.interface import Estimate, EstimatorEntry, Example, FailedEstimate, RegisteredPair


def estimators() -> dict[str, EstimatorEntry]:
    """Return all estimators by name."""
    return {name: entry for entries in _by_module().values() for name, entry in entries.items()}


def estimator_entry(name: str) -> EstimatorEntry:
    """Return the estimator of that name; an unknown one raises an InputError that lists the known."""
    found = estimators()
    if name not in found:
        raise InputError(f"estimator '{name}'", "unknown", f"known are {', '.join(found)}")
    return found[name]


def estimator_module(name: str) -> str:
    """Return the module that lists the estimator."""
    estimator_entry(name)
    return next(module for module, entries in _by_module().items() if name in entries)


def require_estimator_settings(name: str, settings: Mapping[str, object]) -> None:
    """Raise an InputError unless the estimator is known and takes these settings."""
    require_arguments(f"estimator '{name}'", estimator_entry(name).function, 1, settings)


def make_estimator(
    name: str, settings: Mapping[str, object] | None = None, examples: Sequence[Example] = ()
) -> Callable[[RegisteredPair], Estimate]:
    """Return an estimator as a function from registered pairs to estimates.

    A failure inside it, at learning too, becomes an estimate that says why. So does a registration without any
    correspondence, which no estimator is asked about.

    Args:
        examples: registrations of training objects by the same method, for one that learns.

    Raises:
        InputError: an unknown name, settings that it does not take, or one that learns without examples.
    """
    settings = dict(settings or {})
    require_estimator_settings(name, settings)
    entry = estimator_entry(name)
    unlearnt = ""
    estimate: Callable[[RegisteredPair], np.ndarray] | None = None
    if entry.learn is not None:
        if not examples:
            known = ", ".join(other for other, each in estimators().items() if each.learn is None)
            fault = "learns from registrations of training objects, and there are none here"
            raise InputError(f"estimator '{name}'", fault, f"choose one of {known}")
        try:
            estimate = entry.learn(examples, **settings)
        except FailedEstimate as failure:
            unlearnt = str(failure)
    elif entry.estimate is not None:
        function = entry.estimate
        estimate = lambda registered: function(registered, **settings)  # noqa: E731

    def told(registered: RegisteredPair) -> Estimate:
        if estimate is None:
            return Estimate(None, unlearnt)
        if registered.outcome.fitness == 0:
            return Estimate(None, registered.outcome.failure or "no source point is near the target")
        try:
            covariance_6_6 = estimate(registered)
            if not np.isfinite(covariance_6_6).all():
                raise FailedEstimate("the covariance is not finite")
        except FailedEstimate as failure:
            return Estimate(None, str(failure))
        return Estimate((covariance_6_6 + covariance_6_6.T) / 2)

    return told


def _by_module() -> dict[str, dict[str, EstimatorEntry]]:
    names = sorted(f"{folder.__name__}.{module.name}" for module in pkgutil.iter_modules(folder.__path__))
    return {name: getattr(import_module(name), "ESTIMATORS", {}) for name in names}
