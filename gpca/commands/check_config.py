"""Step ``check-config``: configs -> whether a run can use them. It runs nothing and needs no Snakemake.

Snakemake reads a file of ``--configfile`` before it comes to anything of the suite, so what it cannot read, or takes a
minute and gigabytes for, ends in its own words there. Here every fault is one line.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.config.check import read
from gpca.config.layers import read_file, with_defaults
from gpca.errors import InputError


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the configs."""
    parser.add_argument("configs", nargs="*", type=Path, help="config files, merged into the default in this order")


def run(options: Namespace) -> None:
    """Lay the configs over the default and check the result."""
    if options.settings:
        raise InputError("--settings", "is not used by check-config", "name a config file")
    config, sources = read(with_defaults(*map(read_file, options.configs)), {})
    print(f"run {config['run']}: valid; sources {', '.join(sources)}; seeds {', '.join(map(str, config['seeds']))}")
