"""The steps of the workflow as commands, one file each: files in, one function of the library, files out."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator, Mapping

from gpca.errors import InputError
from gpca.settings import check_settings


def per_seed(options: Namespace, *names: str) -> Iterator[tuple]:
    """Yield for each of ``options.seeds`` the seed and the file that each of the named options gives for it.

    Raises:
        InputError: at the call, when an option gives fewer or more files than there are seeds.
    """
    for name in names:
        if (given := len(getattr(options, name))) != (wanted := len(options.seeds)):
            option = f"--{name.replace('_', '-')}"
            raise InputError(option, f"{given} file(s) for {wanted} seed(s)", "give one for each, in the same order")
    return zip(options.seeds, *(getattr(options, name) for name in names), strict=True)


def checked_sections(settings: Mapping[str, dict], sections: Mapping[str, tuple[str, ...]]) -> dict[str, dict]:
    """Return the parts of ``--settings`` by name, each checked like a section of the config; what is absent is empty.

    Args:
        settings: name -> part.
        sections: name -> path of the section.

    Raises:
        InputError: an unknown name, or what :func:`gpca.settings.check_settings` refuses.
    """
    if unknown := set(settings) - set(sections):
        raise InputError(f"setting {sorted(unknown)[0]}", "unknown", f"known are {', '.join(sections)}")
    given = {name: settings.get(name) or {} for name in sections}
    for name, section in sections.items():
        check_settings(given[name], *section)
    return given
