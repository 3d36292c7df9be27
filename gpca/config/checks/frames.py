"""Checks of the section ``frame_labels``."""

from __future__ import annotations

from gpca.errors import InputError
from gpca.experiments.frame_labels.settings import in_percent
from gpca.pairs.perturbation import CONCEPTS


def check_frame_labels(config: dict) -> None:
    """Check that the targets differ in percent, and that the labels at the start leave a pool.

    A third of the training samples is of each concept.
    """
    targets = config["frame_labels"]["targets"]
    if len(set(map(in_percent, targets))) < len(targets):
        raise InputError("config key frame_labels.targets", "two are equal in whole percent", "remove one")
    initial, train = config["frame_labels"]["initial"], config["real_world"]["train"]
    if initial // 2 >= train // len(CONCEPTS):
        fault = f"{initial} labeled samples of two concepts leave none of {train} training samples for the pool"
        raise InputError("config key frame_labels.initial", fault, "lower it or raise real_world.train")
