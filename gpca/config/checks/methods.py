"""Checks of the sections ``methods`` and ``method_pairs``: methods that exist, their settings, the global start."""

from __future__ import annotations

from collections.abc import Set

from gpca.alignment.methods.registry import left_out, require_global, require_settings
from gpca.errors import InputError, require_names, with_key


def check_methods(config: dict, methods_left_out: Set[str]) -> None:
    """Check that every method takes its settings, and that the global start is one that runs here."""
    for name, settings in config["methods"].items():
        with_key(f"methods.{name}", require_settings, name, settings or {})
    key, start = "method_pairs.global_start", config["method_pairs"]["global_start"]
    require_names(key, [start], config["methods"], "registration method", methods_left_out)
    with_key(key, require_global, start)
    if package := left_out([start]).get(start):
        fault = f"'{start}' needs the package {package}, which is not installed"
        raise InputError(f"config key {key}", fault, "install it or choose another global method")
