"""Checks of the section ``real_world``: encoders that exist, scenes that can be drawn, datasets that are there."""

from __future__ import annotations

from collections.abc import Set

from baselines.registry import require_settings
from gpca.encoders.settings import EncoderSettings
from gpca.errors import InputError, require_names, with_key
from gpca.experiments.frame_labels.settings import in_percent
from gpca.frames.rgbd_scene import SceneSettings
from gpca.frames.source import REAL_WORLD, has_estimates, resolve_datasets
from gpca.objects import procedural
from gpca.pairs.perturbation import CONCEPTS


def check_real_world(config: dict, encoders_left_out: Set[str]) -> None:
    """Check the section against what exists; reads no data."""
    section = config["real_world"]
    require_names("real_world.backbones", section["backbones"], config["encoders"], "encoder", encoders_left_out)
    if REAL_WORLD in config["sources"]:
        raise InputError(
            f"config key sources.{REAL_WORLD}", "is reserved for the frames of real_world", "choose another name"
        )
    with_key("real_world.scenes", SceneSettings.from_dict, section["scenes"])
    for family in section["scenes"].get("families", ()):
        with_key("real_world.scenes.families", procedural.require_family, family)
    with_key("real_world.datasets", resolve_datasets, section["datasets"], config["data_dir"])
    datasets = resolve_datasets(section["datasets"], config["data_dir"])
    if section["initial_pose"].get("form") == "results" and not has_estimates(datasets):
        fault = "form 'results' needs a dataset with results or errors"
        raise InputError("config key real_world.initial_pose", fault, "name the files or choose another form")
    _check_training(config)
    _check_labels(config)
    names = ("condition_backbones", section["condition_backbones"])
    require_names(f"real_world.{names[0]}", names[1], section["backbones"], "backbone", encoders_left_out)
    for name, settings in (section["explainers"] or {}).items():
        with_key(f"real_world.explainers.{name}", require_settings, name, settings or {})


def _check_training(config: dict) -> None:
    """Check that the encoders take what they are trained with on frames."""
    section, encoders = config["real_world"], config["encoders"]
    if section["virtual"]:
        for needed, why in (("datasets", "it renders their models"), ("pretraining", "only this uses it")):
            if not section[needed]:
                fault = f"needs real_world.{needed}: {why}"
                raise InputError("config key real_world.virtual", fault, f"set {needed}, or virtual to null")
    require_names("real_world.training", list(section["training"] or {}), encoders, "encoder", set())
    for name in section["backbones"]:
        for part in ("pretraining", "training"):
            given = (section[part] or {}) if part == "pretraining" else (section[part] or {}).get(name, {})
            with_key(f"real_world.{part}", lambda given=given, name=name: EncoderSettings(**encoders[name] | given))


def _check_labels(config: dict) -> None:
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
