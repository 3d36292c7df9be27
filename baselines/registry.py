"""Every explainer by name: GP-CA itself and the rivals, one per file of this folder.

Those of causes have a folder of their own below it, and names of their own.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Mapping
from importlib import import_module

import baselines.causes
from gpca.errors import InputError
from gpca.explainers.interface import ExplainerEntry
from gpca.settings import require_arguments

CONCEPTS, CAUSES = "concepts", "causes"  # what explainers name: what was perturbed, or what is wrong


def explainers(kind: str = CONCEPTS) -> dict[str, ExplainerEntry]:
    """Return all explainers of a kind by name: GP-CA itself and those of every file in its folder."""
    return {name: entry for entries in _by_module(kind).values() for name, entry in entries.items()}


def explainer_entry(name: str, kind: str = CONCEPTS) -> ExplainerEntry:
    """Return the explainer of that name; an unknown one raises an InputError that lists the known."""
    found = explainers(kind)
    if name not in found:
        raise InputError(f"explainer '{name}'", "unknown", f"known are {', '.join(found)}")
    return found[name]


def require_settings(name: str, settings: Mapping[str, object], kind: str = CONCEPTS) -> None:
    """Raise an InputError unless the explainer is known and takes these settings."""
    require_arguments(f"explainer '{name}'", explainer_entry(name, kind).make, 2, settings)


def explainer_module(name: str, kind: str = CONCEPTS) -> str:
    """Return the module that lists the explainer."""
    explainer_entry(name, kind)
    return next(module for module, entries in _by_module(kind).items() if name in entries)


def _by_module(kind: str) -> dict[str, dict[str, ExplainerEntry]]:
    first, folder = (("gpca.explainers.gpca",), baselines) if kind == CONCEPTS else ((), baselines.causes)
    rivals = sorted(f"{folder.__name__}.{module.name}" for module in pkgutil.iter_modules(folder.__path__))
    return {name: getattr(import_module(name), "EXPLAINERS", {}) for name in (*first, *rivals)}
