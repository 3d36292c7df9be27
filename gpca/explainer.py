"""The interface of every explainer, and how explainers are found by name.

An explainer is a class with ``fit`` and ``explain`` in a file of ``baselines/``, listed in that file's
``EXPLAINERS`` by the name under which the config switches it on::

    EXPLAINERS = {"my_explainer": Entry("My explainer", MyExplainer)}
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from inspect import signature
from typing import Protocol

import baselines
from gpca.attribution import Attribution
from gpca.dataset import Registrations
from gpca.errors import InputError


class Explainer(Protocol):
    """What the workflow calls; made as ``make(source, seed, **settings)``."""

    def fit(self, registrations: Registrations) -> None:
        """Learn from labelled registrations (the rows of split ``train``)."""

    def explain(self, registrations: Registrations) -> Attribution:
        """Attribute every registration. What was perturbed is hidden from it, unless it is an oracle."""


@dataclass(frozen=True)
class Entry:
    """An explainer by name.

    Attributes:
        title: as tables head its column.
        make: called with source, seed and the settings of the config.
        reads: what it needs attached: ``embeddings`` those of the encoder, ``uncertainty/<design>`` the outcomes of
            that design (:mod:`gpca.designs`); ``registrations`` nothing.
        oracle: it is told the truth about what it explains; an upper bound, to be labelled so in its title.
    """

    title: str
    make: Callable[..., Explainer]
    reads: str = "registrations"
    oracle: bool = False

    @property
    def design(self) -> str | None:
        """The design whose outcomes it reads, if any."""
        return self.reads.removeprefix("uncertainty/") if self.reads.startswith("uncertainty/") else None


def explainers() -> dict[str, Entry]:
    """Return all explainers by name: GP-CA itself and those of every file in ``baselines/``."""
    return {name: entry for entries in _by_module().values() for name, entry in entries.items()}


def explainer_entry(name: str) -> Entry:
    """Return the explainer of that name; an unknown one raises an InputError that lists the known."""
    found = explainers()
    if name not in found:
        raise InputError(f"explainer '{name}'", "unknown", f"known are {', '.join(found)}")
    return found[name]


def require_settings(name: str, settings: Mapping[str, object]) -> None:
    """Raise an InputError unless the explainer is known and takes settings of these names."""
    try:
        signature(explainer_entry(name).make).bind("source", 0, **settings)
    except TypeError as fault:
        raise InputError(f"explainer '{name}'", str(fault), "correct its settings") from fault


def explainer_module(name: str) -> str:
    """Return the module that lists the explainer."""
    explainer_entry(name)
    return next(module for module, entries in _by_module().items() if name in entries)


def _by_module() -> dict[str, dict[str, Entry]]:
    rivals = sorted(f"baselines.{module.name}" for module in pkgutil.iter_modules(baselines.__path__))
    return {name: getattr(import_module(name), "EXPLAINERS", {}) for name in ("gpca.concept_attribution", *rivals)}
