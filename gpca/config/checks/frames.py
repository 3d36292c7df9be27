"""Checks of the section ``real_world``: encoders that exist, scenes that can be drawn, datasets that are there."""

from __future__ import annotations

from collections.abc import Set

from gpca.config.checks.named import require_names, with_key
from gpca.errors import InputError
from gpca.frames.rgbd_scene import SceneSettings
from gpca.frames.source import REAL_WORLD, resolve_datasets
from gpca.objects import procedural


def check_real_world(config: dict, encoders_left_out: Set[str]) -> None:
    """Check the section against what exists; reads no data."""
    section = config["real_world"]
    require_names("real_world.backbones", section["backbones"], config["encoders"], "encoder", encoders_left_out)
    if REAL_WORLD in config["sources"]:
        raise InputError(f"config key sources.{REAL_WORLD}", "is the name of real_world's frames", "take another")
    with_key("real_world.scenes", SceneSettings.from_dict, section["scenes"])
    for family in section["scenes"].get("families", ()):
        with_key("real_world.scenes.families", procedural.require_family, family)
    with_key("real_world.datasets", resolve_datasets, section["datasets"], config["data_dir"])
    if section["initial_pose"].get("form") == "results":
        for name, entry in (section["datasets"] or {"scenes": {}}).items():
            if not entry.get("results"):
                key = f"config key real_world.datasets.{name}.results"
                raise InputError(key, "is needed by initial_pose form results", "name the file, or take another form")
