"""GP-CA on objects in depth frames: every backbone with every reduction, and real initial poses (Table VI)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gpca.encoders.reduction import make_reduction, require_room
from gpca.encoders.registry import OPTIONS, EncoderSettings
from gpca.errors import InputError, require_names, with_key
from gpca.experiments.experiment import EXPLAINERS, Experiment, LeftOut, Names, Tidy
from gpca.experiments.explained import titles
from gpca.experiments.frames import encoder_title, frames_of
from gpca.experiments.real_world.settings import RealWorldSettings
from gpca.experiments.real_world.tables import CLASSIC
from gpca.explainers.registry import explainer_entry, require_settings
from gpca.frames.source import ONE_ENCODER, REAL_WORLD, conditions_of, has_estimates, resolve_datasets
from gpca.objects import procedural
from gpca.objects.entry import title_of

POSES = {"results": "Pose estimators", "true_pose": "True pose, small error"}  # titles by form; all others:
GLOBAL_POSE = "Global registration"


def check(config: dict, left_out: LeftOut) -> None:
    """Check that the names in the section exist, without reading data."""
    section, encoders_left_out = config["real_world"], left_out("encoders")
    require_names("real_world.backbones", section["backbones"], config["encoders"], "encoder", encoders_left_out)
    if REAL_WORLD in config["sources"]:
        fault = "is reserved for the frames of real_world"
        raise InputError(f"config key sources.{REAL_WORLD}", fault, "choose another name")
    for family in section["scenes"].get("families", ()):
        with_key("real_world.scenes.families", procedural.require_family, family)
    datasets = with_key("real_world.datasets", resolve_datasets, section["datasets"], config["data_dir"])
    if section["initial_pose"].get("form") == "results" and not has_estimates(datasets):
        fault = "form 'results' needs a dataset with results or errors"
        raise InputError("config key real_world.initial_pose", fault, "name the files or choose another form")
    _check_published(config, encoders_left_out)
    _check_training(config)
    key, backbones = "real_world.condition_backbones", section["backbones"]
    require_names(key, section["condition_backbones"], backbones, "backbone", encoders_left_out)
    key, reductions = "real_world.condition_reductions", section["reductions"]
    require_names(key, section["condition_reductions"], reductions, "reduction", left_out("reductions"))
    for name, settings in (section["explainers"] or {}).items():
        with_key(f"real_world.explainers.{name}", require_settings, name, settings or {})
    _check_reductions(config)


def _check_published(config: dict, encoders_left_out: set[str]) -> None:
    """Check that encoders as published stand beside judged ones, each under a name of its own."""
    section, key = config["real_world"], "real_world.published"
    require_names(key, list(section["published"]), section["backbones"], "backbone", encoders_left_out)
    names = list(section["published"].values())
    require_names(key, names, config["encoders"], "encoder", encoders_left_out)
    if twice := [name for i, name in enumerate(names) if name in (*section["backbones"], *names[:i])]:
        raise InputError(f"config key {key}", f"'{twice[0]}' has rows already", "name another encoder")


def _check_training(config: dict) -> None:
    """Check that the encoders take what they are trained with on frames."""
    section, encoders = config["real_world"], config["encoders"]
    if section["virtual"]:
        for needed, why in (("datasets", "it renders their models"), ("pretraining", "only this uses it")):
            if not section[needed]:
                fault = f"needs real_world.{needed}: {why}"
                raise InputError("config key real_world.virtual", fault, f"set {needed}, or virtual to null")
    require_names("real_world.training", list(section["training"] or {}), encoders, "encoder", set())
    for name in (*section["backbones"], *section["published"].values()):
        changes = {"pretraining": pretraining_of(section, name), "training": (section["training"] or {}).get(name, {})}
        for part, settings in changes.items():
            with_key(f"real_world.{part}", lambda whole: EncoderSettings(**whole), encoders[name] | settings)


def _check_reductions(config: dict) -> None:
    """Check that embeddings have enough components; their length is known of the suite's own backbones only."""
    section = config["real_world"]
    for name in section["reductions"]:
        reduction = make_reduction(name, config["reductions"].get(name) or {})
        for backbone in (*section["backbones"], *section["published"].values()) if reduction else ():
            encoder = EncoderSettings(**config["encoders"][backbone])
            options = OPTIONS.get(encoder.backbone)
            size = options(**encoder.options).embedding_size if options else None
            with_key(f"reductions.{name}", require_room, name, reduction, section["train"], size)


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the rows of Table VI, the conditions of the initial pose, and those that are shown and compared."""
    frames = config["real_world"]
    backbones = reduced_backbones(frames)
    return {
        "frames": REAL_WORLD,
        "backbone": backbones,
        "first_backbone": backbones[0],
        "published": published_backbones(frames),
        "published_seed": list(config["seeds"])[: frames.get("published_seeds")],
        "classic": [name for name in CLASSIC if name in config["explainers"]],
        "frame_explainer": list(frames["explainers"]),
        "compared_backbone": list(frames["backbones"])[1:],
        "unreduced": list(unreduced_methods(frames)),
        "condition": [f"{REAL_WORLD}_{name}" for name in conditions_of(config)],
        "condition_backbone": [
            f"{name}-{reduction}"
            for name in frames["condition_backbones"]
            for reduction in frames["condition_reductions"]
        ],
        "one_encoder": ONE_ENCODER if frames["one_encoder"] else "",
    }


def shown(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the titles of the frames, their initial poses, the encoders and the other explainers."""
    frames = config["real_world"]
    source = frames_of(config)
    poses = {REAL_WORLD: frames["initial_pose"]}
    poses |= {f"{REAL_WORLD}_{name}": entry for name, entry in conditions_of(config).items()}
    first_reduction = next(iter(frames["reductions"]))
    return {
        "frames": source,
        "frames_title": title_of(source),
        "frames_pretrained_on": _pretrained_on(frames),
        "frames_rendered": (frames["virtual"] or {}).get("objects") == "all",
        "frame_conditions": {name: POSES.get(entry.get("form", ""), GLOBAL_POSE) for name, entry in poses.items()},
        "frame_methods": [*reduced_backbones(frames), *published_backbones(frames)],
        "published_encoders": {name: config["encoders"][name] for name in frames["published"].values()},
        "frame_explainers": titles(frames["explainers"]),
        "frame_sees": {name: explainer_entry(explainer).sight for name, explainer in _behind(frames).items()},
        "unreduced_methods": unreduced_methods(frames),
        "backbones": {name: config["encoders"][name] for name in frames["backbones"]},
        "shown_backbones": [f"{backbone}-{first_reduction}" for backbone in frames["backbones"]],
        "backbone_reductions": list(frames["reductions"]),
    }


def _behind(frames: Mapping) -> dict[str, str]:
    """Return the explainer behind each method: itself, or GP-CA for a ``{backbone}-{reduction}``."""
    own = {name: name for name in (*CLASSIC, *frames["explainers"])}
    embedded = [*reduced_backbones(frames), *published_backbones(frames)]
    return dict.fromkeys(embedded, "gpca") | own


def reduced_backbones(frames: Mapping) -> list[str]:
    """Return the rows of Table VI that read embeddings: every encoder with every reduction."""
    return [f"{backbone}-{reduction}" for backbone in frames["backbones"] for reduction in frames["reductions"]]


def published_backbones(frames: Mapping) -> list[str]:
    """Return the rows beside them whose encoders are as published, with every reduction."""
    return [f"{encoder}-{name}" for encoder in frames["published"].values() for name in frames["reductions"]]


def pretraining_of(frames: Mapping, encoder: str) -> dict[str, Any]:
    """Return how an encoder of frames is pretrained; those as published have changes of their own."""
    own = frames.get("published_pretraining", {}) if encoder in frames["published"].values() else {}
    return {**frames["pretraining"], **own} if frames["pretraining"] else {}


def unreduced_methods(frames: Mapping) -> dict[str, str]:
    """Return the titles of the explainers that read a whole embedding of a frame, or none."""
    backbones = [name for name in reduced_backbones(frames) if name.endswith("-none")]
    return {name: encoder_title(*name.split("-")) for name in backbones} | titles(frames["explainers"])


def _pretrained_on(frames: Mapping) -> str:
    """Return the data that the encoders of frames are trained on before the frames; empty where there is none."""
    if not frames["pretraining"]:
        return ""
    if not frames["virtual"]:
        return "whole objects"
    tested = frames["virtual"]["objects"] == "all"
    of = "the models of all objects" if tested else "models of objects that no tested frame shows"
    return f"whole objects and on frames rendered of {of}"


EXPERIMENT = Experiment(
    name="real_world",
    sections={"real_world": RealWorldSettings},
    tidy=(Tidy("real_world.csv"), Tidy("real_world_intervals.csv")),
    names=names,
    shown=shown,
    check=check,
    leavable={"real_world.datasets": Names("dataset"), "real_world.explainers": EXPLAINERS},
    lists={
        "real_world.backbones": "encoders",
        "real_world.condition_backbones": "encoders",
        "real_world.published": "encoders",
        "real_world.training": "encoders",
        "real_world.reductions": "reductions",
        "real_world.condition_reductions": "reductions",
    },
)
