"""The steps of the workflow as commands, one file each: files in, one function of the library, files out."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator

from gpca.errors import InputError


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
