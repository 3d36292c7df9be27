"""The printed numbers under every reading of the choices that the paper leaves unstated (Table XIII)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from gpca.experiments.experiment import Experiment, Names, Tidy
from gpca.experiments.specification_curve.registry import FRAME_INPUT, GROUPS
from gpca.experiments.specification_curve.settings import ReadingSizes
from gpca.settings import Bounds, Keys


@dataclass(frozen=True, kw_only=True)
class Section(ReadingSizes):
    """The choices that the paper leaves unstated, by group, and how much of the data the readings see.

    Attributes:
        frame_seeds: how many of the run's seeds, from the first, are used to train encoders that see other clouds of
            depth frames.
    """

    frame_seeds: Annotated[int, Bounds(minimum=0)]
    groups: Annotated[dict, Keys({name: group.values for name, group in GROUPS.items()})]


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
    sections={"readings": Section},
    tidy=(
        Tidy(
            "readings.csv",
            "gpca.attribution.metrics:read_all_metrics",
            {"paths": "readings/{reading_group}.csv"},
            rule="reading_values",
        ),
    ),
    names=names,
    shown=shown,
    leavable={"readings.groups": Names("group of readings", lambda: GROUPS)},
)
