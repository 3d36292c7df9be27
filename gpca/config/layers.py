"""Configs merged over each other; as a merged config takes nothing away, ``false`` leaves entries out."""

from collections.abc import Callable, Collection, Iterable, Mapping
from copy import deepcopy
from dataclasses import fields
from functools import cache, partial, reduce
from pathlib import Path
from typing import Any

from gpca.config.schema import DESIGNS, Reductions
from gpca.declarations.experiment import EXPLAINERS, Names
from gpca.declarations.registry import experiments
from gpca.errors import InputError, require_names
from gpca.explainers.registry import explainers
from gpca.io.structured_text import read_mapping, read_scalar
from gpca.process.code_files import ROOT

DEFAULTS = tuple(ROOT / "config" / name for name in ("sources.yaml", "readings.yaml", "config.yaml"))
TEMPLATE = "__use_yte__"  # lets Snakemake run code in a config
OPTIONAL: dict[str, Names] = {  # mappings whose entries may be false -> their possible names
    "sources": Names("source"),
    "encoders": Names("encoder"),
    "reductions": Names("reduction", lambda: [field.name for field in fields(Reductions)]),
    "uncertainty": Names("uncertainty", lambda: DESIGNS),
    "explainers": EXPLAINERS,
    **{key: names for each in experiments() for key, names in each.optional_entries.items()},
}
# Mappings name -> true or false, or lists of the names that are true.
SWITCHES = {key: names for each in experiments() for key, names in each.switches.items()}
# Lists and mappings without the names that are left out elsewhere -> the key of the other mapping.
LISTED = {key: names for each in experiments() for key, names in each.lists.items()}


def read_file(path: str | Path) -> dict[str, Any]:
    """Return the config of one file; InputError for what Snakemake would repair or ignore, and for a template."""
    config = read_mapping(path)
    if TEMPLATE in config:
        remedy = "write out its values and remove that key"
        raise InputError(path, f"is a template, and {TEMPLATE} lets it run code", remedy)
    return config


def require_sound(paths: Iterable[str | Path]) -> None:
    """Raise an InputError for the first config that :func:`read_file` refuses, including the defaults."""
    _defaults()
    for path in paths:
        read_file(path)


def with_defaults(*configs: Mapping[str, Any]) -> dict[str, Any]:
    """Return the suite's defaults with configs merged over them, as by Snakemake's ``--configfile``."""
    return reduce(_merged, configs, deepcopy(_defaults()))


@cache
def _defaults() -> dict[str, Any]:
    return reduce(_merged, map(read_file, DEFAULTS), {})


def _merged(lower: Mapping[str, Any], upper: Mapping[str, Any]) -> dict[str, Any]:
    """Merge mappings recursively; any other value of the upper one replaces the lower one's."""
    merged = dict(lower)
    for key, value in upper.items():
        below = merged.get(key)
        both = isinstance(value, Mapping) and isinstance(below, Mapping)
        merged[key] = _merged(below or {}, value) if both else value
    return merged


def in_order(config: Mapping[str, Any], lower: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return a config, whose order is that of rows, with the keys of the defaults, or another, first and in order."""
    lower = _defaults() if lower is None else lower
    ordered = {key: config[key] for key in (*lower, *config) if key in config}
    for key, value in ordered.items():
        if isinstance(value, Mapping) and isinstance(lower.get(key), Mapping):
            ordered[key] = in_order(value, lower[key])
    return ordered


def with_types(value: Any, given: Any) -> Any:
    """Return a config with the command line's values, which Snakemake reads as text, read as in a config file."""
    if isinstance(value, Mapping) and isinstance(given, Mapping):
        return {name: with_types(part, given[name]) if name in given else part for name, part in value.items()}
    if value != given:
        return value
    if isinstance(value, list):
        return [with_types(entry, entry) for entry in value]
    return read_scalar(value) if isinstance(value, str) else value


def without_false(config: Mapping[str, Any]) -> dict[str, Any]:
    """Return the config without the entries left out and the rows that need them; `config` is not changed.

    Keys that name one thing that is left out, such as `figures.source`, and lists of nothing else stay, to be refused.
    """
    left_out = {key: names_left_out(config, key) for key in OPTIONAL}
    whole = dict(config)
    for key, names in left_out.items():
        _change(whole, key, partial(_without, gone=names))
    for key in SWITCHES:
        switches = _at(config, key)
        for name, switch in switches.items() if isinstance(switches, Mapping) else ():
            if not isinstance(switch, bool):
                raise InputError(f"config key {key}.{name}", f"{switch!r} is not a switch", "give true or false")
        _change(whole, key, lambda switches: [name for name, switch in switches.items() if switch])
    for key, of in LISTED.items():
        gone = left_out[of] if isinstance(of, str) else of(lambda key: names_left_out(config, key))
        _change(whole, key, partial(_without, gone=gone), (list, dict))
    if left_out["real_world.datasets"] and not _at(whole, "real_world.datasets"):
        _change(whole, "real_world.virtual", lambda _frames: None)  # no models are left to render
    gone = {name for name, entry in explainers().items() if entry.design in left_out["uncertainty"]}
    for key in (key for key, names in OPTIONAL.items() if names is EXPLAINERS):
        _change(whole, key, partial(_without, gone=gone))
    return whole


def check_left_out(config: Mapping[str, Any]) -> None:
    """Raise an InputError for an unknown name that is false, which would have no effect."""
    for key, names in {**OPTIONAL, **SWITCHES}.items():
        if names.known:
            require_names(key, sorted(names_left_out(config, key)), names.known(), names.noun)


def check_listed(config: Mapping[str, Any], left_out: Callable[[str], set[str]]) -> None:
    """Raise an InputError for a name in a list that the mapping to choose from does not have."""
    for key, of in LISTED.items():
        if isinstance(of, str):
            require_names(key, _at(config, key) or (), _at(config, of), OPTIONAL[of].noun, left_out(of))


def names_left_out(config: Mapping[str, Any], key: str) -> set[str]:
    """Return the names that are false in the mapping at a key, a path with dots."""
    mapping = _at(config, key)
    return {name for name, entry in mapping.items() if entry is False} if isinstance(mapping, Mapping) else set()


def _at(config: Any, key: str) -> Any:
    return reduce(lambda value, name: value.get(name) if isinstance(value, Mapping) else None, key.split("."), config)


def _without(names: list | dict, gone: Collection[str]) -> list | dict:
    """Return a list or mapping without names; a list of nothing else stays."""
    if isinstance(names, dict):
        return {name: entry for name, entry in names.items() if name not in gone}
    return [name for name in names if name not in gone] or names


def _change(config: dict[str, Any], key: str, change, kind: type | tuple[type, ...] = dict) -> None:
    """Apply `change` to the value at the key, in copies of the sections around it."""
    *path, last = key.split(".")
    if isinstance(_at(config, key), kind):
        section = config
        for name in path:
            section[name] = dict(section[name])
            section = section[name]
        section[last] = change(section[last])
