"""Every explainer by name: GP-CA itself and the rivals, one per file of this folder."""

from __future__ import annotations

import pkgutil
from collections.abc import Mapping
from importlib import import_module

import baselines
from gpca.errors import InputError
from gpca.explainers.interface import ExplainerEntry
from gpca.settings import require_arguments


def explainers() -> dict[str, ExplainerEntry]:
    """Return all explainers by name: GP-CA itself and those of every file in ``baselines/``."""
    return {name: entry for entries in _by_module().values() for name, entry in entries.items()}


def explainer_entry(name: str) -> ExplainerEntry:
    """Return the explainer of that name; an unknown one raises an InputError that lists the known."""
    found = explainers()
    if name not in found:
        raise InputError(f"explainer '{name}'", "unknown", f"known are {', '.join(found)}")
    return found[name]


def require_settings(name: str, settings: Mapping[str, object]) -> None:
    """Raise an InputError unless the explainer is known and takes these settings."""
    require_arguments(f"explainer '{name}'", explainer_entry(name).make, 2, settings)


def explainer_module(name: str) -> str:
    """Return the module that lists the explainer."""
    explainer_entry(name)
    return next(module for module, entries in _by_module().items() if name in entries)


def _by_module() -> dict[str, dict[str, ExplainerEntry]]:
    rivals = sorted(f"baselines.{module.name}" for module in pkgutil.iter_modules(baselines.__path__))
    return {name: getattr(import_module(name), "EXPLAINERS", {}) for name in ("gpca.explainers.gpca", *rivals)}
