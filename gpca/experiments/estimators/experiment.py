"""Estimators of a pose's covariance against further registrations and against the error (Table XII)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from gpca.alignment.methods.registry import method_entry, methods, require_local
from gpca.errors import InputError, with_key
from gpca.experiments.estimators.settings import MILD, OTHER_SOURCE, REFERENCES, SHIFTS, EstimatorPairSettings
from gpca.experiments.experiment import ByName, Experiment, LeftOut, Names, Tidy
from gpca.settings import part_of
from gpca.uncertainty.estimators.registry import estimator_entry, estimators, require_estimator_settings


def check(config: dict, _left_out: LeftOut) -> None:
    """Check that every estimator takes its settings, and that the methods are ones that start at an initial pose."""
    for name, settings in config["estimators"].items():
        with_key(f"estimators.{name}", require_estimator_settings, name, settings or {})
    if not config["estimator_pairs"]["methods"]:
        raise InputError("config key estimator_pairs.methods", "is empty", "name a method, such as point_to_point")
    for name in config["estimator_pairs"]["methods"]:
        with_key(f"estimator_pairs.methods.{name}", require_local, name)


def names(config: Mapping[str, Any], sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the estimators, and with them and the references before them all that have files of estimates."""
    compared = list(config["estimators"])
    return {"estimator": compared, "estimate": [*REFERENCES, *compared, *_trained_otherwise(config, sources)]}


def shown(config: Mapping[str, Any], sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the titles of the estimators and of the methods whose registrations they see, and the conditions.

    Of `estimates`, those that are trained otherwise among them, also what they model.
    """
    entries = {name: estimator_entry(name) for name in config["estimators"]}
    estimates = {name: {"title": entry.title, "models": entry.models} for name, entry in entries.items()}
    for name, (learner, shift) in _trained_otherwise(config, sources).items():
        estimates[name] = estimates[learner] | {"title": f"{entries[learner].title}, {SHIFTS[shift]}"}
    return {
        "estimators": {name: entry.title for name, entry in entries.items()},
        "estimates": estimates,
        "estimated_methods": {name: method_entry(name).title for name in config["estimator_pairs"]["methods"]},
        "estimator_pairs": config["estimator_pairs"] | {"failed": config["success"]["error"]},
    }


def estimates_of(estimator: str, config: Mapping[str, Any], sources: Mapping[str, Mapping]) -> list[str]:
    """Return the names under which an estimator has files: its own, and those by which it is trained otherwise."""
    others = _trained_otherwise(config, sources)
    return [estimator, *(name for name, (learner, _) in others.items() if learner == estimator)]


def _trained_otherwise(config: Mapping[str, Any], sources: Mapping[str, Mapping]) -> dict[str, tuple[str, str]]:
    """Return name -> what learns, and with what else than the training samples of its own source."""
    shifts = (MILD, OTHER_SOURCE) if len(sources) > 1 else (MILD,)
    learners = [name for name in config["estimators"] if estimator_entry(name).learn]
    return {f"{name}_{shift}": (name, shift) for name in learners for shift in shifts}


Pairs = Annotated[dict, part_of(EstimatorPairSettings, without=("failed",))]  # success.error says what has failed
EXPERIMENT = Experiment(
    name="estimators",
    sections={"estimators": ByName, "estimator_pairs": Pairs},
    tidy=(
        Tidy(
            "estimators.csv",
            "gpca.experiments.estimators.calibration:collect_estimates",
            {"files": "estimates/{source}/{estimate}/seed{seed}.csv"},
            rule="estimator_metrics",
        ),
        Tidy(
            "estimator_intervals.csv",
            "gpca.experiments.estimators.calibration:collect_intervals",
            {"files": "estimates/{source}/{estimate}/seed{seed}.csv"},
        ),
    ),
    names=names,
    shown=shown,
    check=check,
    optional_entries={
        "estimators": Names("estimator", estimators),
        "estimator_pairs.methods": Names("registration method", methods),
    },
)
