"""Registration methods on pairs of scans, by how much these overlap and how far off local methods start."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gpca.alignment.methods.registry import installed, require_global, require_settings
from gpca.errors import InputError, require_names, with_key
from gpca.experiments.experiment import Experiment, LeftOut, Names, Tidy
from gpca.experiments.scans.settings import ChoiceSettings, ScanSettings, part
from gpca.objects.entry import title_of
from gpca.scans.source import ScanEntry, entry_of, place_of


def check(config: dict, left_out: LeftOut) -> None:
    """Check the settings of methods on scans, and that the data sets that are not optional are there."""
    section = config["scans"]
    with_key("scans", part, ChoiceSettings, section)
    for name, settings in section["methods"].items():
        with_key(f"scans.methods.{name}", require_settings, name, settings or {})
    key = "scans.global_start"
    require_names(key, [section["global_start"]], config["methods"], "registration method", left_out("methods"))
    with_key(key, require_global, section["global_start"])
    for name, settings in section["datasets"].items():
        if name in config["sources"]:
            raise InputError(f"config key scans.datasets.{name}", "is the name of a source too", "choose another name")
        if (entry := entry_of(settings)).location and entry.kind != "virtual":
            with_key(f"scans.datasets.{name}", place_of, entry, config["data_dir"])


def present(config: Mapping[str, Any]) -> dict[str, ScanEntry]:
    """Return the data sets that are there, by name; an optional one may be missing."""
    entries = {name: entry_of(settings) for name, settings in config["scans"]["datasets"].items()}
    data_dir = config["data_dir"]
    return {name: entry for name, entry in entries.items() if entry.kind == "virtual" or place_of(entry, data_dir)}


def missing(config: Mapping[str, Any]) -> dict[str, str]:
    """Return the titles of the optional data sets that are not there, each with where it is found."""
    found = present(config)
    entries = {name: entry_of(settings) for name, settings in config["scans"]["datasets"].items()}
    return {entry.title: entry.address for name, entry in entries.items() if name not in found}


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the data sets that are there, those among them whose protocol is published, and the seeds."""
    found = present(config)
    return {
        "scan_set": list(found),
        "scan_benchmark": [name for name, entry in found.items() if entry.benchmark],
        "scan_seed": list(config["seeds"])[: config["scans"]["seeds"]],
        "scan_method": installed(config["methods"]),
    }


def shown(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return titles, strata and rungs, and what is missing."""
    section, found = config["scans"], present(config)
    return {
        "scan_titles": {
            name: title_of({"title": entry.title, "stand_in": entry.stand_in}) for name, entry in found.items()
        },
        "scan_benchmarks": [name for name, entry in found.items() if entry.benchmark],
        "scan_sets_missing": missing(config),
        "scan_strata": list(section["strata"]),
        "scan_ladder": list(section["ladder"]),
        "scan_start": section["global_start"],
        "scan_success": section["success"],
    }


EXPERIMENT = Experiment(
    name="scans",
    sections={"scans": ScanSettings},
    tidy=(
        Tidy(
            "scans.csv",
            "gpca.experiments.scans.metrics:collect_scans",
            {"files": "scan_trials/{scan_set}/{scan_method}/seed{scan_seed}.csv"},
            {"strata": "scans.strata", "success": "scans.success"},
        ),
    ),
    needs=("scan_set", "scan_method"),
    names=names,
    shown=shown,
    check=check,
    leavable={"scans.datasets": Names("data set of scans")},
    lists={"scans.methods": "methods"},
)
