"""Registration methods on the same pairs, each from the initial pose and from that of a global method (Table XI)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gpca.alignment.methods.registry import (
    installed,
    left_out,
    method_entry,
    methods,
    require_global,
    require_settings,
)
from gpca.errors import InputError, require_names, with_key
from gpca.experiments.experiment import ByName, Experiment, LeftOut, Names, Tidy
from gpca.experiments.registration_methods.settings import PairSettings


def check(config: dict, names_left_out: LeftOut) -> None:
    """Check that every method takes its settings, and that the global start is one that runs here."""
    for name, settings in config["methods"].items():
        with_key(f"methods.{name}", require_settings, name, settings or {})
    for part in ("points_of", "neighbors_of"):
        own, left_out_here = list(config["method_pairs"].get(part) or {}), names_left_out("methods")
        require_names(f"method_pairs.{part}", own, config["methods"], "registration method", left_out_here)
    key, start = "method_pairs.global_start", config["method_pairs"]["global_start"]
    require_names(key, [start], config["methods"], "registration method", names_left_out("methods"))
    with_key(key, require_global, start)
    if package := left_out([start]).get(start):
        fault = f"'{start}' needs the package {package}, which is not installed"
        raise InputError(f"config key {key}", fault, "install it or choose another global method")


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the methods whose packages are installed."""
    return {"method": installed(config["methods"])}


def shown(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the titles and kinds of the methods, those whose package is missing here, and the global start."""
    entries = {name: method_entry(name) for name in installed(config["methods"])}
    return {
        "methods": {name: {"title": entry.title, "is_global": entry.is_global} for name, entry in entries.items()},
        "methods_left_out": {method_entry(name).title: of for name, of in left_out(config["methods"]).items()},
        "global_start": config["method_pairs"]["global_start"],
    }


EXPERIMENT = Experiment(
    name="registration_methods",
    sections={"method_pairs": PairSettings, "methods": ByName},
    tidy=(
        Tidy(
            "registration_methods.csv",
            "gpca.experiments.registration_methods.metrics:collect_trials",
            {"files": "methods/{source}/{method}/seed{seed}.csv"},
            {"severities": "registrations.severities", "success": "success"},
        ),
        Tidy(
            "registration_intervals.csv",
            "gpca.experiments.registration_methods.intervals:collect_intervals",
            {"files": "methods/{source}/{method}/seed{seed}.csv", "objects": "objects/{source}.npz"},
            {"severities": "registrations.severities", "success": "success"},
        ),
    ),
    names=names,
    shown=shown,
    check=check,
    leavable={"methods": Names("registration method", methods)},
    lists={"method_pairs.points_of": "methods", "method_pairs.neighbors_of": "methods"},
)
