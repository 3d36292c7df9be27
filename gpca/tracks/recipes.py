"""How each file of samples is made: the step, and what it is given, as the rules of the workflow have it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Any

from gpca.errors import InputError
from gpca.experiments.controls.settings import HARD
from gpca.experiments.scan_causes.experiment import measurement_settings
from gpca.frames.source import REAL_WORLD
from gpca.objects.source import find_file
from gpca.scans.source import entry_of, place_of

# Folders of the files that are made of scans, and what the step calls them.
OF_SCANS = {"scan_causes": "scan_causes", "scan_descriptors": "descriptors", "scan_reenactments": "reenactments"}


@dataclass(frozen=True)
class Recipe:
    """What makes a file.

    Attributes:
        step: module of the step.
        given: names and settings.
        inputs, outputs: of the step, by name; paths below the folder that the files are in. An input that begins with
            ``/`` is data.
    """

    step: str
    given: Mapping[str, Any]
    inputs: Mapping[str, str]
    outputs: Mapping[str, str]


def recipe_of(file: str, config: Mapping[str, Any]) -> Recipe:
    """Return how to make a file with a config that :func:`gpca.config.check.read` returned.

    Args:
        file: its path below the folder of a run, such as ``causes/ycb/seed0.npz``.
    """
    kind, *rest = PurePosixPath(file).with_suffix("").parts
    if kind in ("objects", "instances"):
        return _instances(config) if rest == [REAL_WORLD] else _objects(rest[0], config)
    seed = int(rest[-1].removeprefix("seed"))
    if kind == "timings":  # written beside what they are of
        return recipe_of(f"{rest[1]}/{rest[0]}/{rest[2]}.npz", config)
    if kind in OF_SCANS:
        return _of_scans(rest[-2], seed, config)
    kind = "frame_causes" if kind == "frame_starts" else kind
    if kind == "frame_causes" or (kind == "reenactments" and rest[0] == REAL_WORLD):
        return _of_frames(kind, seed, config)
    source = rest[-2]
    of = {"source": source, "seed": seed}
    icp = {"icp": config["registrations"]["icp"]}
    diagnosis, causes = config["diagnosis"], config["causes"]

    def path(folder: str, suffix: str = "npz") -> str:
        return f"{folder}/{source}/seed{seed}.{suffix}"

    def timings(of_step: str) -> str:
        return f"timings/{source}/{of_step}/seed{seed}.csv"

    if kind in ("causes", HARD):
        settings = causes | (config["controls"]["hard"] if kind == HARD else {}) | icp
        outputs = {"causes": path(kind), "candidates": path(kind, "csv"), "timings": timings(kind)}
        return Recipe("gpca.steps.causes", of | {"settings": settings}, {"objects": f"objects/{source}.npz"}, outputs)
    if kind == "control_embeddings":
        own = {name: value for name, value in config["controls"].items() if name not in ("explainers", "hard")}
        settings = {"controls": own, "encoder": config["encoders"][config["embedding"]["encoder"]]}
        folder = f"{kind}/{HARD}"
        return Recipe(
            "gpca.experiments.controls.encoding",
            of | {"control": HARD, "settings": settings},
            {"registrations": path(HARD)},
            {"embeddings": path(folder), "curve": path(folder, "csv")},
        )
    inputs = {"causes": path("causes"), "causes_timings": timings("causes")}
    if kind == "descriptors":
        outputs = {"descriptors": path(kind), "timings": timings(kind)}
        return Recipe("gpca.steps.describe", of | {"settings": diagnosis["descriptors"] | icp}, inputs, outputs)
    if kind == "reenactments":
        settings = {"reenactment": diagnosis["reenactment"], "causes": causes} | icp
        outputs = {"reenactments": path(kind), "timings": timings(kind)}
        return Recipe("gpca.steps.reenact", of | {"settings": settings}, inputs, outputs)
    if kind in ("cause_embeddings", "cause_encoders"):
        outputs = {"weights": path("cause_encoders", "pt"), "curve": path("cause_encoders", "csv")}
        outputs |= {"embeddings": path("cause_embeddings"), "timings": timings("cause_embeddings")}
        return Recipe("gpca.steps.train_on_causes", of | {"settings": diagnosis["encoder"]}, inputs, outputs)
    raise InputError(file, "is not a file of samples", "name one of a track")


def _objects(source: str, config: Mapping[str, Any]) -> Recipe:
    given = {"source": source, "settings": config["sources"][source], **_data(config)}
    given |= {"surface_points": config["objects"]["surface_points"]}
    return Recipe("gpca.steps.objects", given, _splits("objects", config), {"out": f"objects/{source}.npz"})


def _instances(config: Mapping[str, Any]) -> Recipe:
    section = config["real_world"]
    settings = {"datasets": section["datasets"], "initial_pose": section["initial_pose"]}
    given = {"source": REAL_WORLD, "settings": settings | {"role": config["splits"]["role"]}, **_data(config)}
    given |= {"surface_points": config["objects"]["surface_points"]}
    outputs = {name: f"{name}/{REAL_WORLD}.npz" for name in ("instances", "objects")}
    return Recipe("gpca.steps.instances", given, _splits("scenes", config), outputs)


def _of_frames(kind: str, seed: int, config: Mapping[str, Any]) -> Recipe:
    section = config["real_world"]
    settings = {"datasets": section["datasets"], "role": config["splits"]["role"], "causes": config["causes"]}
    settings |= {"icp": config["registrations"]["icp"]}
    inputs = _splits("scenes", config) | {name: f"{name}/{REAL_WORLD}.npz" for name in ("instances", "objects")}
    measured = {"frame_causes": f"frame_causes/seed{seed}.npz", "starts": f"frame_starts/seed{seed}.npz"}
    given = {"source": REAL_WORLD, "seed": seed, **_data(config)}
    if kind == "frame_causes":
        outputs = measured | {"samples": f"frame_causes/seed{seed}.csv"}
        settings |= {"frames": section["causes"]}
        return Recipe("gpca.experiments.frame_causes.step", given | {"settings": settings}, inputs, outputs)
    settings |= {"reenactment": config["diagnosis"]["reenactment"] | section["reenactment"]}
    outputs = {"reenactments": f"reenactments/{REAL_WORLD}/seed{seed}.npz"}
    return Recipe("gpca.steps.reenact_frames", given | {"settings": settings}, inputs | measured, outputs)


def _of_scans(name: str, seed: int, config: Mapping[str, Any]) -> Recipe:
    place = place_of(entry_of(config["scans"]["datasets"][name]), config["data_dir"])
    given = {"source": name, "seed": seed, "settings": measurement_settings(config, name), "place": str(place or "")}
    outputs = {argument: f"{kind}/{name}/seed{seed}.npz" for kind, argument in OF_SCANS.items()}
    outputs |= {"samples": f"scan_causes/{name}/seed{seed}.csv"}
    return Recipe("gpca.experiments.scan_causes.step", given, {}, outputs)


def _data(config: Mapping[str, Any]) -> dict[str, Any]:
    return {name: config[name] for name in ("data_dir", "downloads")}


def _splits(kind: str, config: Mapping[str, Any]) -> dict[str, str]:
    name = config["splits"][kind]
    return {"splits": str(find_file(name, config["data_dir"]))} if name else {}
