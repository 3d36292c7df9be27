"""The steps of the workflow as commands, one file each: files in, one function of the library, files out."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Any

from gpca.errors import InputError
from gpca.settings import check_settings


def per_seed(options: Namespace, *names: str) -> Iterator[tuple]:
    """Yield for each of ``options.seeds`` the seed and the file that each of the named options gives for it.

    Raises:
        InputError: at the call, when an option gives fewer or more files than there are seeds.
    """
    for name in names:
        require_files(options, name, len(options.seeds), "seed(s)")
    return zip(options.seeds, *(getattr(options, name) for name in names), strict=True)


def require_files(options: Namespace, name: str, wanted: int, things: str) -> None:
    """Raise an InputError unless the option gives as many files as there are things."""
    if (given := len(getattr(options, name))) != wanted:
        fault = f"{given} file(s) for {wanted} {things}"
        raise InputError(f"--{name.replace('_', '-')}", fault, "give one for each, in the same order")


def checked_sections(
    settings: Mapping[str, dict], sections: Mapping[str, tuple[str, ...]], by_name: Collection[str] = ()
) -> dict[str, dict]:
    """Return the parts of ``--settings`` by name, each checked like a section of the config; what is absent is empty.

    Args:
        settings: name -> part.
        sections: name -> path of the section.
        by_name: further parts, which are for :func:`checked_by_name`.

    Raises:
        InputError: an unknown name, or what :func:`gpca.settings.check_settings` refuses.
    """
    known = (*sections, *by_name)
    if unknown := set(settings) - set(known):
        raise InputError(f"setting {sorted(unknown)[0]}", "unknown", f"choose one of {', '.join(known)}")
    given = {name: settings.get(name) or {} for name in known}
    for name, section in sections.items():
        check_settings(given[name], *section)
    return given


def checked_by_name(
    given: dict[str, Any], section: str, names: Collection[str], require: Callable[[str, Mapping], None]
) -> dict[str, dict]:
    """Return the settings of each of the names, none for those that a section of the config does not give.

    Args:
        given: that section, name -> settings.
        require: raises an InputError unless a name is known and takes its settings.
    """
    given = given or dict.fromkeys(names)
    check_settings(given, section)
    for name in (*given, *names):
        require(name, given.get(name) or {})
    return {name: given.get(name) or {} for name in names}


def checked_with_icp(settings: Mapping[str, Any], *section: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return ``--settings`` that are a section of the config, and those of ICP, which they hold under ``icp``."""
    given = dict(settings)
    icp = given.pop("icp", {})
    check_settings(given, *section)
    check_settings(icp, "registrations", "icp")
    return given, icp
