"""Configs laid over each other: the defaults of the suite, and files of a user's own over them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from gpca.code_files import ROOT
from gpca.errors import InputError
from gpca.io.structured_text import read_mapping

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
    for path in (*DEFAULTS, *paths):
        read_file(path)


def with_defaults(*configs: Mapping[str, Any]) -> dict[str, Any]:
    """Return the defaults of the suite with configs laid over them, as Snakemake does it with ``--configfile``."""
    whole: dict[str, Any] = {}
    for config in (*map(read_file, DEFAULTS), *configs):
        whole = _laid_over(whole, config)
    return whole


def _laid_over(lower: Mapping[str, Any], upper: Mapping[str, Any]) -> dict[str, Any]:
    """Return both; where both have a mapping, the two are merged, and of all else the upper one's counts."""
    whole = dict(lower)
    for key, value in upper.items():
        below = whole.get(key)
        merged = isinstance(value, Mapping) and isinstance(below, Mapping)
        whole[key] = _laid_over(below or {}, value) if merged else value
    return whole
