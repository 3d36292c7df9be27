"""Values of ``--config name=value``: Snakemake reads those inside lists and mappings as text, whatever they are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gpca.io.structured_text import read_scalar


def with_types(config: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the config with the command line's values read as in a config file: numbers, booleans, null.

    Args:
        config: of the run, in which values from the command line are laid over the others.
        given: of the command line alone, as Snakemake parsed it. Only what is the same in the config is read anew: a
            workflow that uses this one as a module may have a config of its own.
    """
    return {
        name: _typed(value, given[name]) if isinstance(given, Mapping) and name in given else value
        for name, value in config.items()
    }


def _typed(value: Any, given: Any) -> Any:
    if isinstance(value, Mapping) and isinstance(given, Mapping):
        return with_types(value, given)
    return _read(value) if value == given else value


def _read(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {name: _read(entry) for name, entry in value.items()}
    if isinstance(value, list):
        return [_read(entry) for entry in value]
    return read_scalar(value) if isinstance(value, str) else value
