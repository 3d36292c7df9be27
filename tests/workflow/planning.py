"""Plans runs, dry, each in a process that is forked from a server which has loaded Snakemake once.

Snakemake takes as long to load as to plan. The suite itself is not loaded: each copy of the project brings its own.
"""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
import tempfile
from pathlib import Path

WALL_SECONDS = 300  # a hang, on the busiest machine
_SERVER = multiprocessing.get_context("forkserver")
_SERVER.set_forkserver_preload(["tests.workflow.loaded"])


def plan(arguments: list[str], folder: Path, environment: dict[str, str]) -> subprocess.CompletedProcess:
    """Run ``python -m snakemake <arguments>`` in `folder`; nothing but a dry run is safe in a fork."""
    with tempfile.TemporaryDirectory() as kept:
        streams = [Path(kept) / name for name in ("stdout", "stderr")]
        process = _SERVER.Process(target=_child, args=(arguments, folder, environment, *streams))
        process.start()
        process.join(WALL_SECONDS)
        process.kill()
        process.join()
        return subprocess.CompletedProcess(arguments, process.exitcode, *(stream.read_text() for stream in streams))


def _child(arguments: list[str], folder: Path, environment: dict[str, str], stdout: Path, stderr: Path) -> None:
    for path, descriptor in ((stdout, 1), (stderr, 2)):
        os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT), descriptor)
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    sys.path.insert(0, str(folder))
    sys.argv = ["snakemake", *arguments]
    from snakemake.cli import main

    main()
