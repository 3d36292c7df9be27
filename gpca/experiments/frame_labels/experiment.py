"""Labels that a classifier needs for a new concept on depth frames (Sec. IV-E); their numbers join those of frames."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gpca.errors import InputError, require_names
from gpca.experiments.experiment import Experiment, LeftOut
from gpca.experiments.frame_labels.settings import FrameLabelSettings, in_percent
from gpca.pairs.perturbation import CONCEPTS


def check(config: dict, left_out: LeftOut) -> None:
    """Check the backbones, that the targets differ in percent, and that the labels at the start leave a pool.

    A third of the training samples is of each concept.
    """
    key, encoders = "frame_labels.backbones", left_out("encoders")
    require_names(key, config["frame_labels"]["backbones"], config["encoders"], "encoder", encoders)
    targets = config["frame_labels"]["targets"]
    if len(set(map(in_percent, targets))) < len(targets):
        raise InputError("config key frame_labels.targets", "two are equal in whole percent", "remove one")
    initial, train = config["frame_labels"]["initial"], config["real_world"]["train"]
    if initial // 2 >= train // len(CONCEPTS):
        fault = f"{initial} labeled samples of two concepts leave none of {train} training samples for the pool"
        raise InputError("config key frame_labels.initial", fault, "lower it or raise real_world.train")


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the seeds, and the backbones that the depth frames have."""
    section = config["frame_labels"]
    return {
        "frame_label_seed": list(config["seeds"])[: section["seeds"]],
        "frame_label_backbone": [name for name in config["real_world"]["backbones"] if name in section["backbones"]],
    }


def shown(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the conditions: those of active learning, where frames have none of their own."""
    frames = config["real_world"]
    samples = {"train": frames["train"], "test": frames["test"]}
    return {"frame_labels": {**config["active_learning"], **config["frame_labels"], **samples}}


EXPERIMENT = Experiment(
    name="frame_labels",
    sections={"frame_labels": FrameLabelSettings},
    names=names,
    shown=shown,
    check=check,
    lists={"frame_labels.backbones": "encoders"},
)
