"""Causes of failed registrations of scans to scans: what they are, and who names them (Table XVIII)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from pydantic import Field

from gpca.causes.settings import DescriptorSettings
from gpca.errors import with_key
from gpca.experiments.experiment import Experiment, LeftOut, Names, Tidy
from gpca.experiments.scan_causes.settings import ScanSamples
from gpca.experiments.scans import ChoiceSettings
from gpca.explainers.interface import icp_calls
from gpca.explainers.registry import CAUSES, explainer_entry, explainers, require_settings
from gpca.reenactment.settings import ReenactmentSettings
from gpca.settings import Distinct, changes_of, fields_of
from gpca.steps.scan_trials import TrialSettings

Learned = Distinct[Literal["objects", "scans"]]


@dataclass(frozen=True, kw_only=True)
class Section(ScanSamples):
    """Which registrations are measured, and who explains them.

    Attributes:
        reenactment: ``diagnosis.reenactment`` with these changes.
        explainers: name -> where it has learned; its settings are those of ``diagnosis.explainers``.
    """

    reenactment: Annotated[dict, changes_of(ReenactmentSettings)] = field(default_factory=dict)
    explainers: Annotated[dict[str, Learned], Field(min_length=1)]


def check(config: dict, _left_out: LeftOut) -> None:
    """Check that every explainer exists, and takes the settings that it has in the diagnosis."""
    for name, settings in settings_of_explainers(config).items():
        with_key(f"scan_causes.explainers.{name}", require_settings, name, settings, CAUSES)


def settings_of_explainers(config: Mapping[str, Any]) -> dict[str, dict]:
    """Return the settings of each explainer of scans."""
    of_diagnosis = config["diagnosis"]["explainers"]
    return {name: of_diagnosis.get(name) or {} for name in config["scan_causes"]["explainers"]}


def reenactment_settings(config: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of re-enactments of scans: those of objects, with changes."""
    return config["diagnosis"]["reenactment"] | (config["scan_causes"].get("reenactment") or {})


def measurement_settings(config: Mapping[str, Any], scan_set: str) -> dict[str, Any]:
    """Return what the step that measures the causes of a data set of scans is given."""
    scans = config["scans"]
    first = scans["global_start"]
    return {
        "samples": fields_of(config["scan_causes"], ScanSamples),
        "entry": scans["datasets"][scan_set],
        "role": config["splits"]["role"],
        "scans": fields_of(scans, ChoiceSettings, TrialSettings) | {"success": scans["success"]},
        "methods": {first: scans["methods"].get(first) or config["methods"].get(first)},
        "causes": config["causes"],
        "descriptors": config["diagnosis"]["descriptors"],
        "reenactment": reenactment_settings(config),
    }


def diagnosis_settings(
    config: Mapping[str, Any], explainers: Mapping[str, Sequence[str]], settings: Mapping[str, Mapping]
) -> dict[str, Any]:
    """Return what the step that explains scans is given.

    Args:
        explainers: name -> where it learns.
        settings: of each.
    """
    return {
        "samples": fields_of(config["scan_causes"], ScanSamples),
        "explainers": explainers,
        "settings": settings,
        "causes": {"starts": config["causes"]["starts"]},
        "descriptors": config["diagnosis"]["descriptors"],
        "reenactment": reenactment_settings(config),
        "encoder": config["diagnosis"]["encoder"],
    }


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the explainers."""
    return {"scan_explainer": list(config["scan_causes"]["explainers"])}


def shown(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the titles of the explainers, what each sees, and the runs of ICP that it costs."""
    starts, descriptors = config["causes"]["starts"], DescriptorSettings(**config["diagnosis"]["descriptors"])
    reenactment = ReenactmentSettings(**reenactment_settings(config)).calls(starts)
    entries = {name: explainer_entry(name, CAUSES) for name in config["scan_causes"]["explainers"]}
    costs = {
        name: {"sees": entry.sight, "icp_calls": icp_calls(entry.sees, starts, descriptors, reenactment)}
        for name, entry in entries.items()
    }
    return {"scan_explainers": {name: entry.title for name, entry in entries.items()}, "scan_costs": costs}


EXPERIMENT = Experiment(
    name="scan_causes",
    sections={"scan_causes": Section},
    tidy=(
        Tidy(
            "scan_causes.csv",
            "gpca.experiments.scan_causes.metrics:collect",
            {
                "causes_files": "scan_causes/{scan_set}/seed{scan_seed}.npz",
                "sample_files": "scan_causes/{scan_set}/seed{scan_seed}.csv",
                "prediction_files": "scan_diagnoses/seed{scan_seed}.csv",
            },
            {"overlaps": "scans.strata"},
            rule="scan_cause_metrics",
        ),
    ),
    needs=("scan_set",),
    names=names,
    shown=shown,
    check=check,
    leavable={"scan_causes.explainers": Names("explainer", lambda: explainers(CAUSES))},
)
