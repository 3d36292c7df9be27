"""The configuration of a run: checked once, when the workflow loads, so that a mistake stops it with one line."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

from baselines.registry import explainer_entry, require_settings
from gpca.active_learning.acquisition import STRATEGIES, STREAMS
from gpca.comparison.verdicts import Tolerance
from gpca.encoders.registry import require_backbone
from gpca.errors import InputError
from gpca.frames.rgbd_scene import SceneSettings
from gpca.frames.situations import SituationSettings
from gpca.frames.source import REAL_WORLD, resolve_datasets
from gpca.objects import procedural
from gpca.objects.source import resolve
from gpca.pairs.synthesis import RegistrationSettings
from gpca.provenance import CONFIG_VARIABLE, sha256_of_settings
from gpca.recovery.actions import action_of
from gpca.recovery.policies import policy_entry
from gpca.recovery.policy import Thresholds
from gpca.settings import check_settings, load_schema, require_valid

# Where data lies, and how results are judged: two runs that differ in nothing else are runs of one config.
_OF_NO_RESULT = ("data_dir", "downloads", "comparison", "reference")


def check(config: dict) -> dict[str, dict]:
    """Check a configuration against the schema and against what exists; a source that is false is left out.

    Returns:
        the resolved entry of every source, by name, with ``stand_in`` set.

    Raises:
        InputError: unknown key, wrong type, value out of range; unknown source, family, kind, explainer or backbone;
            data that is neither in its folder nor downloadable. The line names the key.
    """
    if isinstance(config.get("sources"), dict):  # whatever else it is, the schema says so
        # A copy: a Snakemake that is given this config, as for the report, has to leave the source out once more.
        config = config | {"sources": {name: entry for name, entry in config["sources"].items() if entry is not False}}
    require_valid(config, load_schema(), "config key")
    with_key("registrations.severities", RegistrationSettings.from_dict, config["registrations"])
    for name, encoder in config["encoders"].items():
        with_key(f"encoders.{name}.backbone", require_backbone, encoder["backbone"])
    if (name := config["embedding"]["encoder"]) not in config["encoders"]:
        known = ", ".join(config["encoders"])
        raise InputError("config key embedding.encoder", f"no encoder '{name}'", f"known are {known}")
    for name, settings in config["explainers"].items():
        with_key(f"explainers.{name}", require_settings, name, settings or {})
        design = explainer_entry(name).design
        if design and design not in config["uncertainty"]:
            known = ", ".join(config["uncertainty"])
            raise InputError(f"config key explainers.{name}", f"no uncertainty '{design}'", f"known are {known}")
    for strategy in config["active_learning"]["strategies"]:
        if strategy not in (strategies := {**STRATEGIES, **STREAMS}):
            known = ", ".join(strategies)
            raise InputError("config key active_learning.strategies", f"no strategy '{strategy}'", f"known are {known}")
    for name, settings in config["learners"].items():
        own = (config["explainers"].get(name) or {}) | (settings or {})
        with_key(f"learners.{name}", require_settings, name, own)
        with_key(f"learners.{name}", check_settings, own, "explainers", name)
        if explainer_entry(name).reads != "embeddings":
            raise InputError(f"config key learners.{name}", "does not read embeddings", "choose another")
    with_key("shift.severities", RegistrationSettings.from_dict, {"severities": config["shift"]["severities"]})
    for unit, tolerance in config["comparison"]["tolerances"].items():
        with_key(f"comparison.tolerances.{unit}", lambda given: Tolerance(**given), tolerance)
    _check_real_world(config)
    _check_recovery(config)
    sources = {
        name: {"stand_in": entry["kind"] == "procedural"}
        | with_key(f"sources.{name}", resolve, entry, config["data_dir"])
        for name, entry in config["sources"].items()
    }
    if (name := config["figures"]["source"]) not in sources:
        raise InputError("config key figures.source", f"no source '{name}'", f"known are {', '.join(sources)}")
    for name in config["kernel_grid"]["sources"]:
        if name not in sources:
            raise InputError("config key kernel_grid.sources", f"no source '{name}'", f"known are {', '.join(sources)}")
    for key, names in {"source": (*sources, REAL_WORLD), "encoder": tuple(config["encoders"])}.items():
        if (name := config["model"][key]) not in names:
            raise InputError(f"config key model.{key}", f"no {key} '{name}'", f"known are {', '.join(names)}")
    return sources


def _check_real_world(config: dict) -> None:
    section = config["real_world"]
    for backbone in section["backbones"]:
        if backbone not in config["encoders"]:
            known = ", ".join(config["encoders"])
            raise InputError("config key real_world.backbones", f"no encoder '{backbone}'", f"known are {known}")
    if REAL_WORLD in config["sources"]:
        raise InputError(f"config key sources.{REAL_WORLD}", "is the name of real_world's frames", "take another")
    with_key("real_world.scenes", SceneSettings.from_dict, section["scenes"])
    for family in section["scenes"].get("families", ()):
        with_key("real_world.scenes.families", procedural.require_family, family)
    with_key("real_world.datasets", resolve_datasets, section["datasets"], config["data_dir"])
    if section["initial_pose"].get("form") == "results":
        for name, entry in (section["datasets"] or {"scenes": {}}).items():
            if not entry.get("results"):
                key = f"config key real_world.datasets.{name}.results"
                raise InputError(key, "is needed by initial_pose form results", "name the file, or take another form")


def _check_recovery(config: dict) -> None:
    section = config["recovery"]
    for name, settings in section["actions"].items():
        with_key(f"recovery.actions.{name}", action_of, name, settings or {})
    for concept, action in section["treatments"].items():
        if action not in section["actions"]:
            known = ", ".join(section["actions"])
            raise InputError(f"config key recovery.treatments.{concept}", f"no action '{action}'", f"known are {known}")
    if len(set(section["treatments"].values())) < len(section["treatments"]):
        raise InputError("config key recovery.treatments", "one action treats two concepts", "give each its own")
    for name in section["policies"]:
        entry = with_key("recovery.policies", policy_entry, name, tuple(section["actions"]))
        if entry.explainer:
            given = config["explainers"].get(entry.explainer) or {}
            with_key(f"explainers.{entry.explainer}", require_settings, entry.explainer, given)
            if (design := explainer_entry(entry.explainer).design) and design not in config["uncertainty"]:
                raise InputError(f"config key recovery.policies: {name}", f"no uncertainty '{design}'", "name it there")
    declared = {name: section["thresholds"][name] for name in ("uncertain", "dominant", "improvement")}
    declared = {name: value for name, value in declared.items() if value is not None}
    with_key("recovery.thresholds", lambda: Thresholds(**declared))
    ranges: dict[str, Any] = {name: tuple(section[name]) for name in ("noise_scale", "hidden")}
    with_key("recovery", lambda: SituationSettings(**ranges))


def with_key(key: str, function, *arguments):
    """Call the function and name the config's key in front of its InputError."""
    try:
        return function(*arguments)
    except InputError as fault:
        raise InputError(f"config key {key}", str(fault)) from fault


def export(config: dict) -> None:
    """Set what the jobs of a run inherit: the configuration's hash, for their provenance, and this very Python.

    Jobs call ``python``, which need not be the one that runs the workflow where its environment is not activated.
    """
    os.environ[CONFIG_VARIABLE] = sha256_of_settings({k: v for k, v in config.items() if k not in _OF_NO_RESULT})
    os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
