"""Causes of failed registrations: explainers against the measured shares of each cause in the error (Table IX)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from gpca.causes.settings import DescriptorSettings
from gpca.encoders.registry import NamedEncoder, require_backbone, require_draws
from gpca.errors import InputError, with_key
from gpca.experiments.experiment import ByName, Experiment, LeftOut, Names, Tidy
from gpca.explainers.interface import icp_calls
from gpca.explainers.registry import CAUSES, explainer_entry, explainers, require_settings
from gpca.reenactment.settings import ReenactmentSettings
from gpca.settings import part_of


@dataclass(frozen=True)
class Section:
    """The settings by which explainers of causes describe, re-enact, encode and explain a pair."""

    descriptors: Annotated[dict, part_of(DescriptorSettings)]
    reenactment: Annotated[dict, part_of(ReenactmentSettings)]
    encoder: NamedEncoder
    explainers: ByName
    by_features: ByName


def check(config: dict, _left_out: LeftOut) -> None:
    """Check the explainers, and the encoder, for whose draws the clouds need points enough."""
    encoder = config["diagnosis"]["encoder"]
    with_key("diagnosis.encoder.backbone", require_backbone, encoder["backbone"])
    require_draws("diagnosis.encoder", encoder, config["causes"]["points"][1], "causes.points")
    for key in ("explainers", "by_features"):
        for name, settings in config["diagnosis"][key].items():
            with_key(f"diagnosis.{key}.{name}", require_settings, name, settings or {}, CAUSES)
    for name in config["diagnosis"]["by_features"]:
        if explainer_entry(name, CAUSES).reads != "descriptors":
            fault = "reads no descriptors, by whose parts the explainers of this table differ"
            raise InputError(f"config key diagnosis.by_features.{name}", fault, "move it to diagnosis.explainers")


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the explainers of causes, and those that differ in the parts that they see."""
    section = config["diagnosis"]
    return {"cause_explainer": list(section["explainers"]), "feature_explainer": list(section["by_features"])}


def shown(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the titles of the explainers, and what each sees and costs."""
    starts, descriptors = config["causes"]["starts"], DescriptorSettings(**config["diagnosis"]["descriptors"])
    reenactment = ReenactmentSettings(**config["diagnosis"]["reenactment"]).calls(starts)
    titles: dict[str, dict[str, str]] = {}
    costs: dict[str, dict[str, Any]] = {}
    for key in ("explainers", "by_features"):
        entries = {name: explainer_entry(name, CAUSES) for name in config["diagnosis"][key]}
        titles[key] = {name: entry.title for name, entry in entries.items()}
        costs |= {
            name: {"sees": entry.sight, "icp_calls": icp_calls(entry.sees, starts, descriptors, reenactment)}
            for name, entry in entries.items()
        }
    return {
        "cause_explainers": titles["explainers"],
        "feature_explainers": titles["by_features"],
        "cause_costs": costs,
    }


DIAGNOSED = {
    "prediction_files": "diagnoses/{source}/{cause_explainer}/seed{seed}.csv",
    "causes_files": "causes/{source}/seed{seed}.npz",
}
BY_FEATURES = DIAGNOSED | {"prediction_files": "feature_diagnoses/{source}/{feature_explainer}/seed{seed}.csv"}
EXPERIMENT = Experiment(
    name="diagnosis",
    tidy=(
        Tidy("causes.csv", "gpca.experiments.diagnosis.metrics:collect", DIAGNOSED, rule="cause_metrics"),
        Tidy("cause_intervals.csv", "gpca.experiments.diagnosis.metrics:collect_intervals", DIAGNOSED),
        Tidy("feature_intervals.csv", "gpca.experiments.diagnosis.metrics:collect_intervals", BY_FEATURES),
        Tidy("cause_strata.csv", "gpca.experiments.diagnosis.strata:collect_strata", DIAGNOSED),
    ),
    sections={"diagnosis": Section},
    names=names,
    shown=shown,
    check=check,
    leavable={
        f"diagnosis.{key}": Names("explainer", lambda: explainers(CAUSES)) for key in ("explainers", "by_features")
    },
)
