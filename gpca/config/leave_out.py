"""Entries that a config leaves out with ``false``, and the rows that go with them.

A config that is laid over another can add to its mappings but take nothing away: an entry that is false does that.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import fields
from functools import partial
from typing import Any

from gpca.config.schema import DESIGNS, Reductions
from gpca.errors import InputError, require_names
from gpca.experiments.experiment import EXPLAINERS, Names
from gpca.experiments.registry import experiments
from gpca.explainers.registry import explainers

# Mappings of which any entry may be false -> the names that they have.
LEAVABLE: dict[str, Names] = {
    "sources": Names("source"),
    "encoders": Names("encoder"),
    "reductions": Names("reduction", lambda: [field.name for field in fields(Reductions)]),
    "uncertainty": Names("uncertainty", lambda: DESIGNS),
    "explainers": EXPLAINERS,
    **{key: names for each in experiments() for key, names in each.leavable.items()},
}
# Mappings name -> true or false, read as the list of the names that are true. A list may stand there instead.
SWITCHES = {key: names for each in experiments() for key, names in each.switches.items()}
# Lists and mappings that lose the names of what is left out elsewhere: the key, and that of the other mapping.
LISTED = {key: names for each in experiments() for key, names in each.lists.items()}


def without_false(config: Mapping[str, Any]) -> dict[str, Any]:
    """Return the config without the entries left out and the rows that need them; `config` stays as it is.

    A row is an entry of a list, an explainer or a policy. What names one thing that is left out, such as
    `figures.source`, or a list of nothing else stays: :func:`gpca.config.check.check` says that it has to name another.

    Raises:
        InputError: a switch that is neither true nor false.
    """
    left_out = {key: set(_false_names(_at(config, key))) for key in LEAVABLE}
    whole = dict(config)
    for key, names in left_out.items():
        _change(whole, key, partial(_without, gone=names))
    for key in SWITCHES:
        _change(whole, key, lambda switches, key=key: list(_names_switched_on(key, switches)))
    for key, of in LISTED.items():
        gone = left_out[of] if isinstance(of, str) else of(lambda key: names_left_out(config, key))
        _change(whole, key, partial(_without, gone=gone), (list, dict))
    if left_out["real_world.datasets"] and not _at(whole, "real_world.datasets"):
        _change(whole, "real_world.virtual", lambda _frames: None)  # no models are left to render
    without = {name for name, entry in explainers().items() if entry.design in left_out["uncertainty"]}
    for key in (key for key, names in LEAVABLE.items() if names is EXPLAINERS):
        _change(whole, key, partial(_without, gone=without))
    return whole


def check_left_out(config: Mapping[str, Any]) -> None:
    """Check the names that are false: one that nothing has would be left out in vain, and nobody would notice."""
    for key, names in {**LEAVABLE, **SWITCHES}.items():
        if names.known:
            require_names(key, sorted(names_left_out(config, key)), names.known(), names.noun)


def names_left_out(config: Mapping[str, Any], key: str) -> set[str]:
    """Return the names that are false in the mapping at a key, which is a path with dots."""
    return set(_false_names(_at(config, key)))


def _false_names(mapping: Any) -> Iterator[str]:
    if isinstance(mapping, Mapping):  # whatever else it is, the schema says so
        yield from (name for name, entry in mapping.items() if entry is False)


def _names_switched_on(key: str, switches: Mapping[str, Any]) -> Iterator[str]:
    for name, switch in switches.items():
        if not isinstance(switch, bool):
            raise InputError(f"config key {key}.{name}", f"{switch!r} is not a switch", "give true or false")
        if switch:
            yield name


def _at(config: Mapping[str, Any], key: str) -> Any:
    value: Any = config
    for name in key.split("."):
        value = value.get(name) if isinstance(value, Mapping) else None
    return value


def _without(names: list | dict, gone: Collection[str]) -> list | dict:
    """Return a list or mapping without the names that are gone; a list of nothing else stays."""
    if isinstance(names, dict):
        return {name: entry for name, entry in names.items() if name not in gone}
    return [name for name in names if name not in gone] or names


def _change(config: dict[str, Any], key: str, change, kind: type | tuple[type, ...] = dict) -> None:
    """Replace the value at the key by `change` of it, in copies of the sections on the way."""
    *path, last = key.split(".")
    if not isinstance(_at(config, key), kind):
        return
    section = config
    for name in path:
        section[name] = dict(section[name])
        section = section[name]
    section[last] = change(section[last])
