"""Runs every collecting and drawing script of the workflow: log, provenance and errors around its one call."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, redirect_stderr
from pathlib import Path

from gpca.errors import InputError
from gpca.process.provenance import record_provenance


@contextmanager
def job(snakemake) -> Iterator[None]:
    """Run a job of the workflow: stderr to its log, provenance beside its outputs.

    An InputError ends as its one line and status 2.

    Args:
        snakemake: the object that Snakemake gives to a script; its input `code` is no data.
    """
    data = [
        path for paths in data_of(snakemake.input).values() for path in ([paths] if isinstance(paths, str) else paths)
    ]
    parameters = {name: value for name, value in snakemake.params.items() if isinstance(name, str)}
    with ExitStack() as stack:
        if snakemake.log:
            Path(snakemake.log[0]).parent.mkdir(parents=True, exist_ok=True)
            log = stack.enter_context(Path(snakemake.log[0]).open("w", encoding="utf-8"))
            stack.enter_context(redirect_stderr(log))
        try:
            with record_provenance(list(snakemake.output), data, parameters):
                yield
        except InputError as fault:
            print(fault, file=sys.stderr)
            sys.exit(2)


def data_of(files) -> dict[str, str | list[str]]:
    """Return a script's inputs by name, without `code`: a path, or a list of them."""
    return {name: paths if isinstance(paths, str) else list(paths) for name, paths in files.items() if name != "code"}
