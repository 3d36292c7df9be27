"""Every explainer by name: GP-CA itself, the rivals in ``baselines/``, and those from outside."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from gpca.errors import InputError
from gpca.explainers.interface import REENACTED, Describing, ExplainerEntry
from gpca.pairs.dataset import Registrations
from gpca.process.registry import Registry
from gpca.settings import require_arguments

Embed = Callable[[Registrations, str], tuple[np.ndarray, np.ndarray]]  # and the name of their source -> h and logits
CONCEPTS, CAUSES = "concepts", "causes"  # explainers name what was perturbed, or what is wrong
REGISTRIES: dict[str, Registry[ExplainerEntry]] = {
    CONCEPTS: Registry("explainer", "baselines", "EXPLAINERS", first=("gpca.explainers.gpca",), outside=ExplainerEntry),
    CAUSES: Registry("explainer", "baselines", "CAUSE_EXPLAINERS", outside=ExplainerEntry),
}


def explainers(kind: str = CONCEPTS) -> dict[str, ExplainerEntry]:
    return REGISTRIES[kind].entries()


def explainer_entry(name: str, kind: str = CONCEPTS) -> ExplainerEntry:
    return REGISTRIES[kind].entry(name)


def require_settings(name: str, settings: Mapping[str, object], kind: str = CONCEPTS, reenacted: bool = False) -> None:
    entry = explainer_entry(name, kind)
    require_arguments(f"explainer '{name}'", entry.make, 2, settings)
    if kind == CONCEPTS and entry.reads == REENACTED and not reenacted:
        fault = "reads re-enactments, which no samples but those of the control hard have"
        raise InputError(f"explainer '{name}'", fault, "name it in controls.explainers alone")


def explainer_module(name: str, kind: str = CONCEPTS) -> str:
    return REGISTRIES[kind].module(name)


def make_rivals(explainers: Mapping[str, Mapping], source: str, seed: int) -> dict[str, ExplainerEntry]:
    """Explainers of a section of the config, name -> settings, which are made without further arguments."""
    if not explainers:
        raise InputError("setting explainers", "is empty", "name at least one")
    rivals = {}
    for name, settings in explainers.items():
        require_settings(name, settings, reenacted=True)
        entry = explainer_entry(name)
        rivals[name] = replace(entry, make=partial(entry.make, source, seed, **settings))
    return rivals


def described_for(rivals: Mapping[str, ExplainerEntry], registrations: Registrations) -> Registrations:
    """Registrations with the explainers' measurements attached, made once for all training sets."""
    for rival in rivals.values():
        explainer = rival.made()
        if isinstance(explainer, Describing):
            registrations = explainer.describe(registrations)
    return registrations
