"""Sections of the config about what a robot sees and does: frames of real scenes, and recovery."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import Field

from gpca.causes.frame_settings import FrameCauseSettings
from gpca.config.sections import EncoderChanges, SurfacePoints
from gpca.config.source_section import Checksums, Name, Place, Text, Unit, Urls
from gpca.encoders.settings import EncoderSettings
from gpca.frames.camera import Camera
from gpca.frames.initial_pose import InitialPoseSettings
from gpca.frames.rgbd_scene import SceneSettings
from gpca.pairs.perturbation import CONCEPTS, Hidden
from gpca.pairs.synthesis import TestSamples, TrainSamples
from gpca.recovery.settings import LoopSettings
from gpca.settings import Bounds, Count, Distinct, Keys, NotNegative, OpenShare, Share, changes_of, part_of

Pretraining = Annotated[dict, changes_of(EncoderSettings, without=("backbone", "options", "reading", "draws"))]
# The encoder then embeds draws of the size that it was last trained on.
Training = Annotated[
    dict, changes_of(EncoderSettings, without=("backbone", "options", "reading", "draw_points", "draws"))
]


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
    most_frames: Count = 1


@dataclass(frozen=True)
class VirtualFrames:
    """Frames rendered of the datasets' own models: so many scenes, views of each, and training samples in all."""

    count: Annotated[int, Bounds(minimum=2)]
    views: Count
    train: TrainSamples


@dataclass(frozen=True)
class RealWorld:
    """Registrations of depth frames, every backbone with every reduction."""

    title: Text
    scenes: SceneSettings
    datasets: dict[Name, FrameDataset] | None
    initial_pose: InitialPoseSettings
    conditions: dict[Name, InitialPoseSettings] | None
    condition_backbones: list[str]
    train: TrainSamples
    test: TestSamples
    test_share: OpenShare
    occluders: Share
    backbones: Distinct[str]
    reductions: Distinct[Literal["none", "pca", "umap", "autoencoder"]]
    pretraining: Pretraining | None
    virtual: VirtualFrames | None
    training: dict[str, Training] | None
    explainers: dict[str, dict | None] | None
    one_encoder: bool
    causes: FrameCauseSettings


@dataclass(frozen=True)
class DeclaredThresholds:
    """When a policy takes which branch; without `uncertain` the calibration samples set it, by `queued_share`."""

    uncertain: NotNegative | None
    queued_share: Annotated[float, Bounds(minimum=0, exclusiveMaximum=1)]
    dominant: Share
    improvement: Share


@dataclass(frozen=True)
class Estimator(InitialPoseSettings):
    """How the robot estimates a pose."""

    form: Literal["global_registration"] = "global_registration"


@dataclass(frozen=True)
class Recovery:
    """What is done about a failed registration, in a closed loop on tables of the virtual camera."""

    objects: str
    policies: Distinct[str]
    treatments: Annotated[dict, Keys(dict.fromkeys(CONCEPTS, str), required=CONCEPTS)]
    actions: Annotated[dict[str, dict | None], Field(min_length=1)]  # an action checks its settings itself
    costs: dict[str, Share]
    needless: Share
    thresholds: DeclaredThresholds
    rehearsals: Count
    loop: Annotated[dict, part_of(LoopSettings, without=("cloud_points", "icp"))]
    train: TrainSamples
    calibration: TestSamples
    remedied: TestSamples
    tables: Count
    camera: Camera
    noise_scale: tuple[NotNegative, NotNegative]
    hidden: tuple[Hidden, Hidden]
    estimator: Annotated[dict, changes_of(Estimator, without=("rotation_deg", "translation"))]
    model_points: SurfacePoints
    encoder: EncoderChanges
