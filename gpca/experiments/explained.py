"""The explainers of an experiment: those of its section of the config, with settings beyond those of ``explainers``."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Any

from gpca.errors import InputError, with_key
from gpca.explainers.registry import explainer_entry, require_settings

DESIGN = "additive"  # the design whose conditions are estimated


def require_explained(config: Mapping[str, Any], key: str) -> Iterator[tuple[str, str]]:
    """Check that every explainer at a key exists and takes its settings, which add to those that it has elsewhere.

    Yields:
        the key of each in the config, and its name.

    Raises:
        InputError: an unknown explainer or setting.
    """
    section: Any = config
    for part in key.split("."):
        section = section[part]
    for name, settings in section.items():
        key_of_name = f"{key}.{name}"
        own = (config["explainers"].get(name) or {}) | (settings or {})
        with_key(key_of_name, require_settings, name, own)
        yield key_of_name, name


def titles(names: Collection[str]) -> dict[str, str]:
    """Return the titles of explainers by name."""
    return {name: explainer_entry(name).title for name in names}


def require_exchangeable(name: str) -> None:
    """Raise an InputError unless the explainer is known and reads what is exchanged.

    That is registrations, their embeddings, the conditions of design ``additive``, or of any the observed pair alone.
    """
    entry = explainer_entry(name)
    if entry.design not in (None, DESIGN) and not entry.observed_only:
        fault = f"reads design '{entry.design}', which estimators do not provide"
        raise InputError(f"explainer '{name}'", fault, f"choose one that reads '{DESIGN}'")
