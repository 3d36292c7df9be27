"""The explainers of an experiment: those of its section of the config, with settings beyond those of ``explainers``."""

from collections.abc import Iterator, Mapping
from typing import Any

from gpca.errors import with_key
from gpca.explainers.registry import CONCEPTS, require_settings


def require_explained(config: Mapping[str, Any], key: str) -> Iterator[tuple[str, str]]:
    """Check that every explainer at a key exists and takes its settings, which add to those that it has elsewhere.

    Yields the key of each in the config, and its name.
    """
    section: Any = config
    for part in key.split("."):
        section = section[part]
    for name, settings in explainer_settings(config, section).items():
        with_key(f"{key}.{name}", require_settings, name, settings, CONCEPTS, key == "controls.explainers")
        yield f"{key}.{name}", name


def explainer_settings(config: Mapping[str, Any], explainers: Mapping[str, Mapping | None]) -> dict[str, dict]:
    """Settings of an experiment's explainers, added to those that they have elsewhere."""
    return {
        name: {**(config["explainers"].get(name) or {}), **(settings or {})} for name, settings in explainers.items()
    }
