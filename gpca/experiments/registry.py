"""All experiments, by their folders: a new folder is found at the next call."""

from __future__ import annotations

import pkgutil
from functools import cache
from importlib import import_module
from pathlib import Path

from gpca.experiments.experiment import Experiment


@cache
def experiments() -> tuple[Experiment, ...]:
    """Return the experiments, by their names."""
    folders = pkgutil.iter_modules([str(Path(__file__).parent)])
    names = sorted(folder.name for folder in folders if folder.ispkg)
    return tuple(import_module(f"{__package__}.{name}.experiment").EXPERIMENT for name in names)
