"""Checks of what a config leaves out: a name that nothing has would be left out in vain, and nobody would notice."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import fields

from gpca.config.leave_out import names_left_out
from gpca.config.schema import DESIGNS
from gpca.config.sections import Reductions
from gpca.errors import require_names
from gpca.experiments.registry import experiments
from gpca.explainers.registry import explainers


def check_left_out(config: dict) -> None:
    """Check the names that are false; sources, encoders and datasets may have any name."""
    for key, (noun, known) in _known().items():
        require_names(key, sorted(names_left_out(config, key)), known, noun)
    for experiment in experiments():
        for key, names in {**experiment.leavable, **experiment.switches}.items():
            if names.known:
                require_names(key, sorted(names_left_out(config, key)), names.known(), names.noun)


def _known() -> dict[str, tuple[str, Collection[str]]]:
    return {
        "reductions": ("reduction", [field.name for field in fields(Reductions)]),
        "uncertainty": ("uncertainty", DESIGNS),
        "explainers": ("explainer", explainers()),
        "learners": ("learner", explainers()),
    }
