"""The printed numbers under every reading of what the paper leaves unstated (Table XIII)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gpca.experiments.experiment import Experiment, Names
from gpca.experiments.specification_curve.registry import FRAME_INPUT, GROUPS


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the groups of readings; the one that trains encoders of depth frames is run where there are seeds."""
    readings = config["readings"]
    trains = readings["frame_seeds"] and "none" in config["real_world"]["reductions"]
    groups = [name for name in readings["groups"] if name != FRAME_INPUT or trains]
    return {"reading_group": groups, "frame_input": [name for name in groups if name == FRAME_INPUT]}


def shown(config: Mapping[str, Any], sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the titles of the groups."""
    return {"reading_groups": {name: GROUPS[name].title for name in names(config, sources)["reading_group"]}}


EXPERIMENT = Experiment(
    name="specification_curve",
    tidy=("readings.csv",),
    names=names,
    shown=shown,
    leavable={"readings.groups": Names("group of readings", lambda: GROUPS)},
)
