"""Options of a command line: a parser that refuses in one line, types for numbers, and files one per seed."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from typing import NoReturn

from gpca.errors import InputError
from gpca.io.names import is_name
from gpca.numerals import whole


class OneLineParser(argparse.ArgumentParser):
    """A parser whose errors are one line, as every other refusal of the suite, and whose names are on one line, too."""

    def parse_args(self, args=None, namespace=None):
        """Parse; what is given as text, and not as a path or a number, names something, but for the settings."""
        options = super().parse_args(args, namespace)
        for option, value in vars(options).items():
            for text in value if isinstance(value, list) else [value]:
                if isinstance(text, str) and option != "settings" and not is_name(text):
                    fault = f"{text!r} is empty or does not fit on one line"
                    raise InputError(f"--{option.replace('_', '-')}", fault, "give a name")
        return options

    def error(self, message: str) -> NoReturn:
        """End with status 2 and one line that names the command, the fault and the help."""
        self.exit(2, f"{self.prog}: {' '.join(message.split())}; see '{self.prog} --help'\n")


def whole_number(least: int, most: int) -> Callable[[str], int]:
    """Return the type of an option that takes a whole number from `least` to `most`."""

    def read(text: str) -> int:
        try:
            return whole(text, least, most)
        except ValueError as fault:  # argparse shows the words of its own error alone
            raise argparse.ArgumentTypeError(str(fault)) from fault

    return read


# More threads than any machine of today has cores; OpenMP and numba crash where they cannot start as many as they are
# told to, which is at some thousands.
THREADS = whole_number(1, 256)
SEED = whole_number(0, 2**32 - 1)  # what the config takes: UMAP's generator is seeded with 32 bits
SURFACE_POINTS = whole_number(256, 2**20)  # of the config's objects.surface_points
COUNT = whole_number(1, 10**6)  # of what is small; a million of anything that is asked for by hand is a slip


def per_seed(options: argparse.Namespace, *names: str) -> Iterator[tuple]:
    """Yield for each of ``options.seeds`` the seed and the file that each of the named options gives for it.

    Raises:
        InputError: at the call, when an option gives fewer or more files than there are seeds.
    """
    for name in names:
        require_files(options, name, len(options.seeds), "seed(s)")
    return zip(options.seeds, *(getattr(options, name) for name in names), strict=True)


def require_files(options: argparse.Namespace, name: str, wanted: int, things: str) -> None:
    """Raise an InputError unless the option gives as many files as there are things."""
    if (given := len(getattr(options, name))) != wanted:
        fault = f"{given} file(s) for {wanted} {things}"
        raise InputError(f"--{name.replace('_', '-')}", fault, "give one for each, in the same order")
