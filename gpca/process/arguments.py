"""Options of a command line: a parser that refuses in one line, and types for numbers."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import NoReturn

from gpca.errors import InputError
from gpca.io.names import is_name
from gpca.numerals import decimal, whole


class OneLineParser(argparse.ArgumentParser):
    """A parser whose errors take one line, as everywhere in the suite, and whose names do too."""

    def parse_args(self, args=None, namespace=None):
        """Parse; every text but the settings, if it is neither a path nor a number, has to be a name."""
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


def length(text: str) -> float:
    """Read an option that takes a length above 0, in whatever unit the clouds have."""
    try:
        value = decimal(text)
    except ValueError as fault:
        raise argparse.ArgumentTypeError(str(fault)) from fault
    if value <= 0:
        raise argparse.ArgumentTypeError(f"{value:g} is no length; give a positive one")
    return value


# More threads than any machine of today has cores; OpenMP and numba crash where they cannot start as many as they are
# told to, which is at some thousands.
THREADS = whole_number(1, 256)
COUNT = whole_number(1, 10**6)  # of what is small; a million of anything that is asked for by hand is a slip
