"""Options of a command line: a parser with one-line errors, and types of numbers."""

import argparse
from collections.abc import Callable
from typing import Any, NoReturn

from gpca.errors import InputError
from gpca.io.files import is_name
from gpca.numerals import decimal, whole


class OneLineParser(argparse.ArgumentParser):
    """A parser with one-line errors, which refuses names of several lines."""

    def parse_args(self, args=None, namespace=None):
        """Parse, and check that every text except the settings is a name."""
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
    """Return the type of an option with a whole number from `least` to `most`."""
    return lambda text: _read(whole, text, least, most)


def length(text: str) -> float:
    """Read a positive length in the unit of the clouds."""
    if (value := _read(decimal, text)) <= 0:
        raise argparse.ArgumentTypeError(f"{value:g} is no length; give a positive one")
    return value


def _read(read: Callable[..., Any], text: str, *limits: int) -> Any:
    try:
        return read(text, *limits)
    except ValueError as fault:  # argparse shows only the text of its own error
        raise argparse.ArgumentTypeError(str(fault)) from fault


THREADS = whole_number(1, 256)  # OpenMP and numba crash where they cannot start as many as asked, some thousands
COUNT = whole_number(1, 10**6)  # larger counts are typos
