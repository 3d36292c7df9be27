"""Makes files of samples, each in a process of its own, whose libraries are held to the instructions of a run's jobs.

Whoever asks for samples may have loaded NumPy long before, with other instructions and so with other last digits.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gpca.code_files import ROOT
from gpca.errors import InputError

if TYPE_CHECKING:
    from gpca.tracks.recipes import Recipe


def make(files: Iterable[str], folder: Path, config: Mapping[str, Any], processes: int) -> None:
    """Make those of the files that are missing, and what they are made from, so many at a time.

    Args:
        files: paths below the folder of a run.
        folder: where they are kept, as in a run.

    Raises:
        InputError: a step that failed; its own line says why.
    """
    from gpca.tracks.recipes import recipe_of

    steps: dict[str, Recipe] = {}  # by the first of their outputs
    open_files = list(files)
    while open_files:
        file = open_files.pop()
        if file.startswith("/") or (folder / file).is_file():
            continue
        recipe = recipe_of(file, config)
        first = next(iter(recipe.outputs.values()))
        if first not in steps:
            steps[first] = recipe
            open_files += recipe.inputs.values()
    while steps:
        waiting = {output for recipe in steps.values() for output in recipe.outputs.values()}
        ready = [name for name, recipe in steps.items() if not waiting & set(recipe.inputs.values())]
        with ThreadPoolExecutor(processes) as pool:
            list(pool.map(lambda name: _run(steps[name], folder), ready))
        for name in ready:
            del steps[name]


def _run(recipe: Recipe, folder: Path) -> None:
    sys.stderr.write(f"making {next(iter(recipe.outputs.values()))}\n")  # whole: several are made at once
    files = {name: str(folder / path) for name, path in {**recipe.inputs, **recipe.outputs}.items()}
    # Sorted, as rules give settings: the first of several datasets comes first in the samples.
    given = json.dumps({"step": recipe.step, "given": dict(recipe.given), "files": files}, sort_keys=True)
    paths = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, "-c", "from gpca.tracks.making import main; main()"],
        input=given,
        env={**os.environ, "PYTHONPATH": paths, "PYTHONSAFEPATH": "1"},
        text=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    if done.returncode:
        words = done.stderr.strip().splitlines() or ["it ended without a word"]
        raise InputError(f"step {recipe.step}", words[-1].removeprefix(f"{recipe.step}: "), "see the line before")


def main() -> None:
    """Run the step that standard input describes; the process ends as one of a run's does."""
    from gpca.process.job import Job, as_process, call, keep_freed_memory
    from gpca.process.processor import prepare

    prepare(1)
    keep_freed_memory()
    described = json.loads(sys.stdin.read())
    files = {name: Path(path) for name, path in described["files"].items()}
    given = described["given"]
    given["downloads"] = Path(given.get("downloads") or "")
    job = Job(threads=1, **{"data_dir": None} | given, **files)
    sys.exit(as_process(described["step"], lambda: call(described["step"], job)))
