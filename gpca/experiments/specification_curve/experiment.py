"""The printed numbers under every reading of the choices that the paper leaves unstated (Table XIII)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, get_args

from gpca.experiments.experiment import Experiment, Names, Tidy
from gpca.experiments.specification_curve.registry import (
    FRAME_ENCODER,
    FRAME_INPUT,
    FRAME_START,
    GROUPS,
    SEVERITIES_RETRAINED,
    OtherSeverities,
)
from gpca.experiments.specification_curve.settings import ReadingSizes
from gpca.frames.source import REAL_WORLD, conditions_of
from gpca.pairs.perturbation import Severities
from gpca.settings import Bounds, Keys

RANGES = get_args(OtherSeverities)


@dataclass(frozen=True, kw_only=True)
class Section(ReadingSizes):
    """The choices that the paper leaves unstated, by group, and how much of the data the readings see.

    Attributes:
        frame_seeds: how many of the run's seeds, from the first, are used to train encoders that see other clouds of
            depth frames.
        severities: ranges that encoders learn from in the place of the protocol's, for as many seeds as `encoders`.
    """

    frame_seeds: Annotated[int, Bounds(minimum=0)]
    severities: Annotated[dict, Keys(dict.fromkeys(RANGES, Severities), required=RANGES)]
    groups: Annotated[dict, Keys({name: group.values for name, group in GROUPS.items()})]


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the groups of readings; some are run only where there is what they read.

    Those that train encoders for each reading need seeds, and others rows of encoders as published, or from poses of
    estimators.
    """
    readings, frames = config["readings"], config["real_world"]
    estimated = [name for name, entry in conditions_of(config).items() if entry.get("form") == "results"]
    readable = {
        FRAME_INPUT: readings["frame_seeds"] and "none" in frames["reductions"],
        FRAME_ENCODER: frames["published"],
        FRAME_START: estimated and frames["condition_backbones"],
        SEVERITIES_RETRAINED: readings["encoders"],
    }
    groups = [name for name in readings["groups"] if readable.get(name, True)]
    return {
        "reading_group": groups,
        "frame_input": [name for name in groups if name == FRAME_INPUT],
        "estimated": f"{REAL_WORLD}_{estimated[0]}" if estimated else "",
    }


def shown(config: Mapping[str, Any], sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the titles of the groups."""
    return {"reading_groups": {name: GROUPS[name].title for name in names(config, sources)["reading_group"]}}


EXPERIMENT = Experiment(
    name="specification_curve",
    sections={"readings": Section},
    tidy=(
        Tidy(
            "readings.csv",
            "gpca.evaluation.measures:read_all_metrics",
            {"paths": "readings/{reading_group}.csv"},
            rule="reading_values",
        ),
    ),
    names=names,
    shown=shown,
    leavable={"readings.groups": Names("group of readings", lambda: GROUPS)},
)
