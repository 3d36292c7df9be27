"""Checks of the sections ``estimators`` and ``estimator_pairs``: names that exist, settings that they take."""

from __future__ import annotations

from gpca.alignment.methods.registry import require_local
from gpca.errors import InputError, with_key
from gpca.uncertainty.estimators.registry import require_estimator_settings


def check_estimators(config: dict) -> None:
    """Check that every estimator takes its settings, and that the methods are ones that start at an initial pose."""
    for name, settings in config["estimators"].items():
        with_key(f"estimators.{name}", require_estimator_settings, name, settings or {})
    methods = config["estimator_pairs"]["methods"]
    if not methods:
        raise InputError("config key estimator_pairs.methods", "is empty", "name a method, such as point_to_point")
    for name in methods:
        with_key(f"estimator_pairs.methods.{name}", require_local, name)
