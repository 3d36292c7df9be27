"""Configs laid over each other: the defaults of the suite, files of a user's own, the values of ``--config``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from copy import deepcopy
from functools import cache, reduce
from pathlib import Path
from typing import Any

from gpca.code_files import ROOT
from gpca.errors import InputError
from gpca.io.structured_text import read_mapping, read_scalar

DEFAULTS = tuple(ROOT / "config" / name for name in ("sources.yaml", "readings.yaml", "config.yaml"))
TEMPLATE = "__use_yte__"  # lets Snakemake run code that stands in a config


def read_file(path: str | Path) -> dict[str, Any]:
    """Return the config of one file; nothing that Snakemake would run, repair or leave out in silence gets through.

    Raises:
        InputError: as :func:`gpca.io.structured_text.read_mapping`, and for a template.
    """
    config = read_mapping(path)
    if TEMPLATE in config:
        raise InputError(
            path, f"is a template, and {TEMPLATE} lets it run code", "write out its values and remove that key"
        )
    return config


def require_sound(paths: Iterable[str | Path]) -> None:
    """Raise an InputError for the first config that :func:`read_file` refuses, be it one of the defaults."""
    _defaults()
    for path in paths:
        read_file(path)


def with_defaults(*configs: Mapping[str, Any]) -> dict[str, Any]:
    """Return the defaults of the suite with configs laid over them, as Snakemake does it with ``--configfile``."""
    return reduce(_laid_over, configs, deepcopy(_defaults()))


@cache
def _defaults() -> dict[str, Any]:
    return reduce(_laid_over, map(read_file, DEFAULTS), {})


def in_order(config: Mapping[str, Any]) -> dict[str, Any]:
    """Return a config whose keys stand in the order of the defaults, further ones behind them.

    Snakemake puts the keys of ``--configfile`` first, and tables have a row for each explainer in the config's order.
    """
    return _in_order_of(config, _defaults())


def _in_order_of(config: Mapping[str, Any], lower: Mapping[str, Any]) -> dict[str, Any]:
    whole: dict[str, Any] = {}
    for key in (*(key for key in lower if key in config), *(key for key in config if key not in lower)):
        value, below = config[key], lower.get(key)
        both = isinstance(value, Mapping) and isinstance(below, Mapping)
        whole[key] = _in_order_of(value, below or {}) if both else value
    return whole


def _laid_over(lower: Mapping[str, Any], upper: Mapping[str, Any]) -> dict[str, Any]:
    """Return both; where both have a mapping, the two are merged, and of all else the upper one's counts."""
    whole = dict(lower)
    for key, value in upper.items():
        below = whole.get(key)
        merged = isinstance(value, Mapping) and isinstance(below, Mapping)
        whole[key] = _laid_over(below or {}, value) if merged else value
    return whole


def with_types(config: Mapping[str, Any], command_line: Mapping[str, Any]) -> dict[str, Any]:
    """Return the config with the command line's values read as in a config file: numbers, booleans, null.

    Snakemake reads those inside lists and mappings as text, whatever they are.

    Args:
        config: of the run, in which values from the command line are laid over the others.
        command_line: its values alone, as Snakemake parsed them. Only what is the same in the config is read anew: a
            workflow that uses this one as a module may have a config of its own.
    """
    return {
        name: _typed(value, command_line[name]) if isinstance(command_line, Mapping) and name in command_line else value
        for name, value in config.items()
    }


def _typed(value: Any, command_line: Any) -> Any:
    if isinstance(value, Mapping) and isinstance(command_line, Mapping):
        return with_types(value, command_line)
    return _read(value) if value == command_line else value


def _read(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {name: _read(entry) for name, entry in value.items()}
    if isinstance(value, list):
        return [_read(entry) for entry in value]
    return read_scalar(value) if isinstance(value, str) else value
