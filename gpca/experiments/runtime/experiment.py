"""Seconds of every stage of an explanation (Table VII)."""

from __future__ import annotations

from gpca.experiments.experiment import Experiment

EXPERIMENT = Experiment(name="runtime", tidy=("runtime.csv",))
