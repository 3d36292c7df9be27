"""Every explainer by name: GP-CA itself, the rivals in ``baselines/``, and those from outside.

A file lists its explainers of concepts as ``EXPLAINERS`` and those of causes as ``CAUSE_EXPLAINERS``, separately named.
"""

from __future__ import annotations

from collections.abc import Mapping

from gpca.explainers.interface import ExplainerEntry
from gpca.process.registry import Registry
from gpca.settings import require_arguments

CONCEPTS, CAUSES = "concepts", "causes"  # explainers name what was perturbed, or what is wrong
REGISTRIES: dict[str, Registry[ExplainerEntry]] = {
    CONCEPTS: Registry("explainer", "baselines", "EXPLAINERS", first=("gpca.explainers.gpca",), outside=ExplainerEntry),
    CAUSES: Registry("explainer", "baselines", "CAUSE_EXPLAINERS", outside=ExplainerEntry),
}


def explainers(kind: str = CONCEPTS) -> dict[str, ExplainerEntry]:
    """Return all explainers of a kind by name."""
    return REGISTRIES[kind].entries()


def explainer_entry(name: str, kind: str = CONCEPTS) -> ExplainerEntry:
    """Return an explainer; an unknown name raises an InputError that lists the known ones."""
    return REGISTRIES[kind].entry(name)


def require_settings(name: str, settings: Mapping[str, object], kind: str = CONCEPTS) -> None:
    """Raise an InputError unless the explainer is known and takes these settings."""
    require_arguments(f"explainer '{name}'", explainer_entry(name, kind).make, 2, settings)


def explainer_module(name: str, kind: str = CONCEPTS) -> str:
    """Return the module that lists the explainer."""
    return REGISTRIES[kind].module(name)
