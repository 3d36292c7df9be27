"""The configuration of a run: checked once, when the workflow loads, so that a mistake stops it with one line."""

from __future__ import annotations

import os
import sys
from difflib import get_close_matches
from pathlib import Path

import yaml

from gpca.encoders.registry import require_backbone
from gpca.errors import InputError
from gpca.explainer import explainer_entry
from gpca.objects.source import resolve
from gpca.provenance import CONFIG_VARIABLE, sha256_of_settings

SCHEMA = Path(__file__).resolve().parent.parent / "workflow" / "schemas" / "config.schema.yaml"


def check(config: dict) -> dict[str, dict]:
    """Check a configuration against the schema and against what exists.

    Returns:
        the resolved entry of every source, by name, with ``stand_in`` set.

    Raises:
        InputError: unknown key, wrong type, value out of range; unknown source, family, kind, explainer or backbone;
            data that is neither in its folder nor downloadable. The line names the key.
    """
    _check_schema(config)
    for name, limits in config["registrations"]["severities"].items():
        if limits[0] > limits[1]:
            raise InputError(f"config key registrations.severities.{name}", f"{limits} runs downwards", "swap the two")
    for name, encoder in config["encoders"].items():
        with_key(f"encoders.{name}.backbone", require_backbone, encoder["backbone"])
    if (name := config["embedding"]["encoder"]) not in config["encoders"]:
        known = ", ".join(config["encoders"])
        raise InputError("config key embedding.encoder", f"no encoder '{name}'", f"known are {known}")
    for name in config["explainers"]:
        with_key(f"explainers.{name}", explainer_entry, name)
    sources = {
        name: {"stand_in": entry["kind"] == "procedural"}
        | with_key(f"sources.{name}", resolve, entry, config["data_dir"])
        for name, entry in config["sources"].items()
    }
    if (name := config["figures"]["fig3_source"]) not in sources:
        raise InputError("config key figures.fig3_source", f"no source '{name}'", f"known are {', '.join(sources)}")
    return sources


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
    os.environ[CONFIG_VARIABLE] = sha256_of_settings(config)
    os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])


def _check_schema(config: dict) -> None:
    from jsonschema import Draft202012Validator
    from jsonschema.exceptions import best_match

    schema = yaml.safe_load(SCHEMA.read_text(encoding="utf-8"))
    fault = best_match(Draft202012Validator(schema).iter_errors(config))
    if fault is None:
        return
    key = ".".join(map(str, fault.absolute_path)) or "(top level)"
    if fault.validator == "additionalProperties":
        known = list(fault.schema["properties"])
        unknown = next(name for name in fault.instance if name not in known)
        path = ".".join([*map(str, fault.absolute_path), unknown])
        close = get_close_matches(unknown, known, n=1)
        raise InputError(
            f"config key {path}", "unknown", f"did you mean {close[0]}?" if close else f"known are {', '.join(known)}"
        )
    raise InputError(f"config key {key}", fault.message, "see workflow/schemas/config.schema.yaml")
