"""Checks the configuration of a run when the workflow loads, so that a mistake stops it with one line."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from typing import Any

from gpca.causes.settings import CauseSettings
from gpca.config import layers
from gpca.config.schema import whole_config
from gpca.declarations.experiment import LeftOut
from gpca.declarations.registry import experiments
from gpca.encoders.registry import require_backbone, require_draws
from gpca.errors import InputError, require_names, with_key
from gpca.explainers.registry import explainer_entry, require_settings
from gpca.frames.source import REAL_WORLD
from gpca.io.structured_text import require_plain
from gpca.objects.canonical import read_object_splits, read_scene_splits
from gpca.objects.source import find_file, require_place, resolve
from gpca.process.plugins import use
from gpca.settings import read_settings

RESERVED = ("reference", "leaderboard", "logs")  # folders of results/ that are no runs
BYTES_PER_POINT = 2 * 3 * 4  # in source and target, three float32
LARGEST_BYTES = 2**36  # a thousand times what five seeds of the paper's protocol take


def read(config: dict, command_line: Mapping, as_module: bool = False) -> tuple[dict, dict[str, dict]]:
    """Return the config of a run in the order of the defaults, without what it leaves out, and :func:`check`'s sources.

    `command_line` has the values given with ``--config``, whose numbers are still text. A config that another workflow
    gives to this one as a module lacks the defaults.
    """
    whole = layers.in_order(layers.with_types(layers.with_defaults(config) if as_module else config, command_line))
    sources = check(whole)
    return with_success(layers.without_false(whole)), sources


def check(config: dict, faults: list[str] | None = None) -> dict[str, dict]:
    """Check a configuration, except entries left out with ``false``; it is not changed.

    Returns the resolved entry of every source, by name. The line of an InputError names the key. With a list, lines of
    all faults are added to it instead; names are checked only if settings and places are without fault.
    """
    noted, sources = partial(_noted, faults), {}
    with noted():
        require_plain(config, "config key")
        with_key("plugins", use, config.get("plugins") or [])
        whole = layers.without_false(config)
        read_settings(whole_config(), whole, "config key")
        whole = with_success(whole)
        for check_first in (_check_places, _check_registrations):
            with noted():
                check_first(whole)
    if faults:
        return {}
    left_out = partial(layers.names_left_out, config)
    for each in (
        partial(layers.check_left_out, config),
        partial(_check_names, whole, left_out, noted),
        partial(layers.check_listed, whole, left_out),
        *(partial(experiment.check, whole, left_out) for experiment in experiments()),
    ):
        with noted():
            each()
    for key, read_splits, names in (
        ("objects", read_object_splits, whole["sources"]),
        ("scenes", read_scene_splits, whole["real_world"]["datasets"] or ()),
    ):
        if place := whole["splits"][key]:
            with noted():
                path = with_key(f"splits.{key}", find_file, place, whole["data_dir"])
                for name in names:
                    with_key(f"splits.{key}", read_splits, path, name)
    for name, entry in whole["sources"].items():
        with noted():
            resolved = with_key(f"sources.{name}", resolve, entry, whole["data_dir"])
            sources[name] = {"stand_in": entry["kind"] == "procedural"} | resolved
    return sources


@contextmanager
def _noted(faults: list[str] | None) -> Iterator[None]:
    """Add the lines of a fault to a list, if there is one."""
    try:
        yield
    except (InputError, OSError) as fault:
        if faults is None:
            raise
        faults += [str(fault), *getattr(fault, "further", ())]


def _check_places(config: dict) -> None:
    if config["run"].lower() in RESERVED:
        raise InputError("config key run", f"results/{config['run']} is reserved", "choose another name")
    if config["data_dir"] is not None:
        data = with_key("data_dir", require_place, config["data_dir"])
        with_key("data_dir", data.exists)  # an OSError for a name that is too long
    folder = with_key("downloads", require_place, config["downloads"])
    existing = next((path for path in (folder, *folder.parents) if path.exists()), folder)
    if not existing.is_dir():
        raise InputError("config key downloads", f"{existing} is not a folder", "name a folder; it need not exist")


def _check_registrations(config: dict) -> None:
    """Check that settings agree with each other, and that the samples of one file fit in memory."""
    if (method := config["registrations"]["icp"]["method"]) != "point_to_point":
        fault = f"is '{method}', but uncertainty and causes are measured by reruns of point-to-point ICP"
        remedy = "use point_to_point; exchange.methods replaces it by other methods below the explainers"
        raise InputError("config key registrations.icp.method", fault, remedy)
    for key, causes in {"causes": {}, "model.causes": config["model"]["causes"]}.items():
        with_key(key, CauseSettings.from_dict, config["causes"] | causes, config["registrations"]["icp"])
    cloud_points = "registrations.cloud_points", config["registrations"]["cloud_points"]
    for section, (key, points) in {
        "registrations": cloud_points,
        "real_world": cloud_points,
        "causes": ("causes.points", config["causes"]["points"][1]),
    }.items():
        samples = config[section]["train"] + config[section]["test"]
        size = samples * points * BYTES_PER_POINT
        if size > LARGEST_BYTES:
            fault = f"{samples} samples take {size / 2**30:.0f} GiB of points, all held by one job"
            raise InputError(f"config key {section}.train", fault, f"use fewer or lower {key}")


def _check_names(config: dict, left_out: LeftOut, noted: Callable[[], AbstractContextManager]) -> None:
    """Check the names of encoders, explainers and sources, and the points of clouds that these read."""
    encoders, points = config["encoders"], config["registrations"]["cloud_points"]
    for name, encoder in encoders.items():
        with noted():
            with_key(f"encoders.{name}.backbone", require_backbone, encoder["backbone"])
            require_draws(f"encoders.{name}", encoder, points, "registrations.cloud_points")
    for name, settings in config["explainers"].items():
        key = f"explainers.{name}"
        with noted():
            with_key(key, require_settings, name, settings or {})
            if design := explainer_entry(name).design:
                require_names(key, [design], config["uncertainty"], "uncertainty", left_out("uncertainty"))
            if (neighbors := (settings or {}).get("neighbours", 0)) > points:
                fault = f"{neighbors} neighbors are too many for {points} points of a cloud"
                raise InputError(f"config key {key}.neighbours", fault, "lower it, or raise registrations.cloud_points")
    model, sources = config["model"], config["sources"]
    for key, value, names, noun in (
        ("embedding.encoder", config["embedding"]["encoder"], encoders, "encoder"),
        ("figures.source", config["figures"]["source"], sources, "source"),
        ("model.source", model["source"], (*sources, REAL_WORLD), "source"),
        ("model.encoder", model["encoder"], encoders, "encoder"),
    ):
        with noted():
            require_names(key, [value], names, noun, left_out(f"{noun}s"))


def with_success(config: Mapping[str, Any]) -> dict[str, Any]:
    """Return the config with ``success.error`` as the ``failed`` limit of the causes, which must not have their own."""

    def limited(key: str, causes: Mapping[str, Any]) -> dict[str, Any]:
        if "failed" in causes["limits"]:
            fault = "would be another definition of failure than that of all experiments"
            raise InputError(f"config key {key}.limits.failed", fault, "set success.error")
        return {**causes, "limits": {**causes["limits"], "failed": config["success"]["error"]}}

    causes, model = limited("causes", config["causes"]), dict(config["model"])
    if "limits" in model["causes"]:
        model["causes"] = limited("model.causes", model["causes"])
    return {**config, "causes": causes, "model": model}
