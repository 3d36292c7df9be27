"""Seconds of every stage of an explanation (Table VII)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from gpca.experiments.experiment import Experiment, Tidy
from gpca.settings import Bounds


@dataclass(frozen=True)
class RuntimeSettings:
    """The number of times that every stage is timed."""

    repeats: Annotated[int, Bounds(minimum=2)] = 100


EXPERIMENT = Experiment(name="runtime", sections={"runtime": RuntimeSettings}, tidy=(Tidy("runtime.csv"),))
