"""Checks of what is learned and compared: encoders, explainers, learners, strategies, tolerances."""

from __future__ import annotations

from collections.abc import Set

from gpca.active_learning.settings import NewConceptSettings
from gpca.causes.settings import CauseSettings
from gpca.comparison.verdicts import Tolerance
from gpca.encoders.registry import require_backbone
from gpca.errors import InputError, require_names, with_key
from gpca.explainers.registry import explainer_entry, require_settings
from gpca.pairs.synthesis import RegistrationSettings

BYTES_PER_POINT = 2 * 3 * 4  # in source and target, three float32
LARGEST_BYTES = 2**36  # few machines have more memory, and five seeds of the paper's protocol take a thousandth


def check_registrations(config: dict) -> None:
    """Check that settings agree with each other, and that the samples of one file can be held in memory."""
    if (method := config["registrations"]["icp"]["method"]) != "point_to_point":
        fault = f"is '{method}', but uncertainty and causes are measured by reruns of point-to-point ICP"
        remedy = "use point_to_point; exchange.methods puts other methods beneath the explainers"
        raise InputError("config key registrations.icp.method", fault, remedy)
    with_key("registrations.severities", RegistrationSettings.from_dict, config["registrations"])
    with_key("shift.severities", RegistrationSettings.from_dict, {"severities": config["shift"]["severities"]})
    for key, causes in {"causes": {}, "model.causes": config["model"]["causes"]}.items():
        with_key(key, CauseSettings.from_dict, config["causes"] | causes, config["registrations"]["icp"])
    cloud_points = "registrations.cloud_points", config["registrations"]["cloud_points"]
    for section, (key, points) in {
        "registrations": cloud_points,
        "real_world": cloud_points,
        "causes": ("causes.points", config["causes"]["points"][1]),
    }.items():
        samples = config[section]["train"] + config[section]["test"]
        size = samples * points * BYTES_PER_POINT
        if size > LARGEST_BYTES:
            fault = f"{samples} samples take {size / 2**30:.0f} GiB of points, all held by one job"
            raise InputError(f"config key {section}.train", fault, f"use fewer or lower {key}")


def check_encoders(config: dict, left_out: Set[str]) -> None:
    """Check the backbones, and the encoder whose embeddings are explained."""
    for name, encoder in config["encoders"].items():
        with_key(f"encoders.{name}.backbone", require_backbone, encoder["backbone"])
    require_names("embedding.encoder", [config["embedding"]["encoder"]], config["encoders"], "encoder", left_out)


def check_explainers(config: dict, left_out: Set[str]) -> None:
    """Check that every explainer exists, takes its settings and finds the uncertainty that it reads."""
    for name, settings in config["explainers"].items():
        with_key(f"explainers.{name}", require_settings, name, settings or {})
        if design := explainer_entry(name).design:
            require_names(f"explainers.{name}", [design], config["uncertainty"], "uncertainty", left_out)


def check_strategies(config: dict) -> None:
    """Check that what is asked about new concepts agrees."""
    with_key("new_concepts", NewConceptSettings.from_dict, config["new_concepts"])


def check_learners(config: dict) -> None:
    """Check that every learner reads embeddings and takes its settings, which add to those it has as an explainer."""
    for name, settings in config["learners"].items():
        own = (config["explainers"].get(name) or {}) | (settings or {})
        with_key(f"learners.{name}", require_settings, name, own)
        if explainer_entry(name).reads != "embeddings":
            raise InputError(f"config key learners.{name}", "does not read embeddings", "choose another")


def check_tolerances(config: dict) -> None:
    """Check that the tolerances of every unit are in order."""
    for unit, tolerance in config["comparison"]["tolerances"].items():
        with_key(f"comparison.tolerances.{unit}", lambda given: Tolerance(**given), tolerance)
