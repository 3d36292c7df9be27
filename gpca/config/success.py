"""The one definition of success, put where the causes have theirs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gpca.errors import InputError

KEY = "failed"  # of the limits of causes


def with_success(config: Mapping[str, Any]) -> dict[str, Any]:
    """Return the config with ``success.error`` as the limit above which the causes say that something failed.

    Raises:
        InputError: a limit of that name, which would be a second definition.
    """
    model = dict(config["model"])
    whole = {**config, "causes": _limited(config, "causes", config["causes"]), "model": model}
    if "limits" in model["causes"]:
        model["causes"] = _limited(config, "model.causes", model["causes"])
    return whole


def _limited(config: Mapping[str, Any], key: str, causes: Mapping[str, Any]) -> dict[str, Any]:
    if KEY in causes["limits"]:
        fault = "would be another definition of failure than that of all experiments"
        raise InputError(f"config key {key}.limits.{KEY}", fault, "set success.error")
    return {**causes, "limits": {**causes["limits"], KEY: config["success"]["error"]}}
