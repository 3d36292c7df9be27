"""All experiments, by their folders: a new folder is found at the next call."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pathlib import Path

from gpca.experiments.experiment import Experiment


@cache
def experiments() -> tuple[Experiment, ...]:
    """Return the experiments, by their names."""
    names = sorted(path.parent.name for path in Path(__file__).parent.glob("*/experiment.py"))
    return tuple(import_module(f"{__package__}.{name}.experiment").EXPERIMENT for name in names)
