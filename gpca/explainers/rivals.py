"""Explainers that an experiment fits more than once, each made anew for every training set."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from gpca.errors import InputError
from gpca.explainers.interface import ConceptExplainer, Describing
from gpca.explainers.registry import explainer_entry, require_settings
from gpca.pairs.dataset import Registrations

Embed = Callable[[Registrations, str], tuple[np.ndarray, np.ndarray]]  # and the name of their source -> h and logits


@dataclass(frozen=True)
class Rival:
    """One explainer.

    Attributes:
        reads, observed_only: what it needs attached, as in :class:`gpca.explainers.interface.ExplainerEntry`.
    """

    make: Callable[[], ConceptExplainer]  # returns a new one at every call
    reads: str
    observed_only: bool = False


def make_rivals(explainers: Mapping[str, Mapping], source: str, seed: int) -> dict[str, Rival]:
    """Explainers of a section of the config, name -> settings."""
    if not explainers:
        raise InputError("setting explainers", "is empty", "name at least one")
    rivals = {}
    for name, settings in explainers.items():
        require_settings(name, settings)
        entry = explainer_entry(name)
        rivals[name] = Rival(partial(entry.make, source, seed, **settings), entry.reads, entry.observed_only)
    return rivals


def described_for(rivals: Mapping[str, Rival], registrations: Registrations) -> Registrations:
    """Registrations with the explainers' measurements attached, made once for all training sets."""
    for rival in rivals.values():
        explainer = rival.make()
        if isinstance(explainer, Describing):
            registrations = explainer.describe(registrations)
    return registrations
