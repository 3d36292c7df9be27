"""GP-CA on objects in depth frames: every backbone with every reduction, and real initial poses (Table VI)."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import Annotated, Any, Literal

from pydantic import Field

from gpca.causes.settings import FrameCauseSettings
from gpca.declarations import EXPLAINERS, Experiment, LeftOut, Names
from gpca.encoders.reduction import make_reduction, require_room
from gpca.encoders.registry import OPTIONS, EncoderSettings
from gpca.errors import InputError, require_names, with_key
from gpca.experiments import frames as frame_rows
from gpca.explainers.registry import require_settings
from gpca.frames.initial_pose import InitialPoseSettings
from gpca.frames.rgbd_scene import SceneSettings
from gpca.frames.source import ONE_ENCODER, REAL_WORLD, conditions_of, has_estimates, require_local, resolve_datasets
from gpca.objects import procedural
from gpca.objects.entry import Checksums, Name, Place, Text, Unit, Urls
from gpca.pairs.synthesis import TestSamples, TrainSamples
from gpca.reenactment.settings import ReenactmentSettings
from gpca.settings import Bounds, Count, Distinct, OpenShare, Share, changes_of

FIXED = ("backbone", "options", "reading", "draws")
Pretraining = Annotated[dict, changes_of(EncoderSettings, without=FIXED)]
# The encoder then embeds draws of the size that it was last trained on.
Training = Annotated[dict, changes_of(EncoderSettings, without=(*FIXED, "draw_points"))]
Reduction = Literal["none", "pca", "umap", "autoencoder"]
# The same hypotheses cost the same everywhere.
Reenactment = Annotated[dict, changes_of(ReenactmentSettings, without=("hypotheses",))]


@dataclass(frozen=True)
class FrameDataset:
    """A dataset of depth frames in BOP format, in a folder or at the addresses that it is downloaded from."""

    location: Place
    urls: Urls = field(default_factory=list)
    sha256: Checksums = None
    unit: Unit = "mm"
    split: Text = "test"
    optional: bool = False
    results: Place | Annotated[list[Place], Field(min_length=1)] | None = None
    errors: Place | None = None
    models: Place | None = None
    most_frames: Count = 1


@dataclass(frozen=True)
class VirtualFrames:
    """Frames rendered of the datasets' own models: numbers of scenes, of views of each, and of training samples.

    Attributes:
        objects: ``training``: those that no frame shows which may be tested; ``all``: those of all frames.
    """

    objects: Literal["training", "all"]
    count: Annotated[int, Bounds(minimum=2)]
    views: Count
    train: TrainSamples


@dataclass(frozen=True)
class RealWorldSettings:
    """Registrations of depth frames, every backbone with every reduction.

    Attributes:
        seeds: how many the rows on frames have at least: those of the run, then the numbers after them.
        published: judged backbone -> encoder of its published architecture, whose rows stand beside the judged ones.
        published_seeds: how many of the run's seeds, from the first, these rows have; null: all.
        published_pretraining: changes of `pretraining` for these encoders.
    """

    title: Text | None
    scenes: SceneSettings
    datasets: dict[Name, FrameDataset] | None
    initial_pose: InitialPoseSettings
    conditions: dict[Name, InitialPoseSettings] | None
    condition_backbones: list[str]
    condition_reductions: Distinct[Reduction]
    train: TrainSamples
    test: TestSamples
    test_share: OpenShare
    occluders: Share
    backbones: Distinct[str]
    reductions: Distinct[Reduction]
    pretraining: Pretraining | None
    virtual: VirtualFrames | None
    published: dict[str, str]
    training: dict[str, Training] | None
    explainers: dict[str, dict | None] | None
    one_encoder: bool
    causes: FrameCauseSettings
    reenactment: Reenactment
    seeds: Count = 1
    published_seeds: Count | None = None
    published_pretraining: Pretraining = field(default_factory=dict)


def check(config: dict, left_out: LeftOut) -> None:
    section, encoders_left_out = config["real_world"], left_out("encoders")
    if REAL_WORLD in config["sources"]:
        fault = "is reserved for the frames of real_world"
        raise InputError(f"config key sources.{REAL_WORLD}", fault, "choose another name")
    for family in section["scenes"].get("families", ()):
        with_key("real_world.scenes.families", procedural.require_family, family)
    datasets = with_key("real_world.datasets", resolve_datasets, section["datasets"], config["data_dir"])
    for name, entry in datasets.items():
        with_key(f"real_world.datasets.{name}", require_local, entry)
    if section["initial_pose"].get("form") == "results" and not has_estimates(datasets):
        fault = "form 'results' needs a dataset with results or errors"
        raise InputError("config key real_world.initial_pose", fault, "name the files or choose another form")
    key, published = "real_world.published", list(section["published"].values())
    require_names(key, list(section["published"]), section["backbones"], "backbone", encoders_left_out)
    require_names(key, published, config["encoders"], "encoder", encoders_left_out)
    if twice := [name for i, name in enumerate(published) if name in (*section["backbones"], *published[:i])]:
        raise InputError(f"config key {key}", f"'{twice[0]}' has rows already", "name another encoder")
    _check_training(config)
    for noun, gone in {"backbone": encoders_left_out, "reduction": left_out("reductions")}.items():
        chosen = section[f"condition_{noun}s"]
        require_names(f"real_world.condition_{noun}s", chosen, section[f"{noun}s"], noun, gone)
    for name, settings in (section["explainers"] or {}).items():
        with_key(f"real_world.explainers.{name}", require_settings, name, settings or {})


def _check_training(config: dict) -> None:
    """Check that encoders take their training on frames, and that the suite's own have room for all components."""
    section, encoders = config["real_world"], config["encoders"]
    for needed, why in (("datasets", "it renders their models"), ("pretraining", "only this uses it")):
        if section["virtual"] and not section[needed]:
            fault = f"needs real_world.{needed}: {why}"
            raise InputError("config key real_world.virtual", fault, f"set {needed}, or virtual to null")
    shown = (*section["backbones"], *section["published"].values())
    for name in shown:
        training = (section["training"] or {}).get(name, {})
        changes = {"pretraining": frame_rows.pretraining_of(section, name), "training": training}
        for part, settings in changes.items():
            with_key(f"real_world.{part}", lambda whole: EncoderSettings(**whole), encoders[name] | settings)
    for name in section["reductions"]:
        reduction = make_reduction(name, config["reductions"].get(name) or {})
        for encoder in (EncoderSettings(**encoders[backbone]) for backbone in shown) if reduction else ():
            options = OPTIONS.get(encoder.backbone)
            size = options(**encoder.options).embedding_size if options else None
            with_key(f"reductions.{name}", require_room, name, reduction, section["train"], size)


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    frames, seeds = config["real_world"], list(config["seeds"])
    further = range(1, 1 + frames.get("seeds", 1) - len(seeds))
    seeds_of = {REAL_WORLD: [*seeds, *(max(seeds) + number for number in further)]}
    backbones, published = frame_rows.reduced_backbones(frames), frame_rows.published_backbones(frames)
    published_seeds = seeds[: frames.get("published_seeds")]
    conditions = [f"{REAL_WORLD}_{name}" for name in conditions_of(config)]
    condition_backbones = list(map("-".join, product(frames["condition_backbones"], frames["condition_reductions"])))
    classic = [name for name in frame_rows.CLASSIC if name in config["explainers"]]
    others = list(frames["explainers"])
    methods_of = {REAL_WORLD: [*backbones, *published, *classic, *others]}
    methods_of |= {condition: [*condition_backbones, *others] for condition in conditions}
    seeds_of |= dict.fromkeys(conditions, seeds)
    return {
        "frames": REAL_WORLD,
        "backbone": backbones,
        "first_backbone": backbones[0],
        "published": published,
        "frame_seed": seeds_of[REAL_WORLD],
        "published_seed": published_seeds,
        "classic": classic,
        "frame_explainer": others,
        "condition": conditions,
        "frame_pose": [f"{source}/seed{seed}" for source, of_source in seeds_of.items() for seed in of_source],
        "condition_backbone": condition_backbones,
        "one_encoder": ONE_ENCODER if frames["one_encoder"] else "",
        "frame_prediction": [
            f"{source}/{method}/seed{seed}"
            for source, methods in methods_of.items()
            for method in methods
            for seed in (published_seeds if method in published else seeds_of[source])
        ],
        "one_encoder_prediction": [
            f"{ONE_ENCODER}/{method}/seed{seed}" for method in backbones for seed in seeds if frames["one_encoder"]
        ],
    }


EXPERIMENT = Experiment(
    name="real_world",
    sections={"real_world": RealWorldSettings},
    beside=("frame_tables", "frame_pictures"),
    names=names,
    check=check,
    optional_entries={"real_world.datasets": Names("dataset"), "real_world.explainers": EXPLAINERS},
    lists={f"real_world.{name}": "encoders" for name in ("backbones", "condition_backbones", "published", "training")}
    | {  # among these may be "none"
        f"real_world.{name}": lambda left_out: left_out("reductions") for name in ("reductions", "condition_reductions")
    },
)
