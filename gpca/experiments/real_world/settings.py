"""The section ``real_world`` of the config: depth frames, and the encoders and explainers on them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import Field

from gpca.causes.settings import FrameCauseSettings
from gpca.encoders.registry import EncoderSettings
from gpca.frames.initial_pose import InitialPoseSettings
from gpca.frames.rgbd_scene import SceneSettings
from gpca.objects.entry import Checksums, Name, Place, Text, Unit, Urls
from gpca.pairs.synthesis import TestSamples, TrainSamples
from gpca.reenactment.settings import ReenactmentSettings
from gpca.settings import Bounds, Count, Distinct, OpenShare, Share, changes_of

Pretraining = Annotated[dict, changes_of(EncoderSettings, without=("backbone", "options", "reading", "draws"))]
# The encoder then embeds draws of the size that it was last trained on.
Training = Annotated[
    dict, changes_of(EncoderSettings, without=("backbone", "options", "reading", "draw_points", "draws"))
]

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
    published_seeds: Count | None = None
    published_pretraining: Pretraining = field(default_factory=dict)
