"""Sections of the config that have keys beyond those of one settings class, in the order of the config."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from gpca.active_learning.settings import ActiveLearningSettings, NewConceptSettings, StreamSettings
from gpca.causes.settings import CauseSettings
from gpca.classifier.settings import GPCSettings
from gpca.encoders.reduction import PCA, UMAP, Autoencoder
from gpca.encoders.settings import EncoderChanges
from gpca.experiments.kernel_grid.grid import KernelGrid
from gpca.experiments.out_of_distribution.settings import ShiftSettings
from gpca.objects.entry import SurfacePoints
from gpca.pairs.perturbation import Concept, Severities
from gpca.settings import (
    Bounds,
    Count,
    Distinct,
    Keys,
    OpenShare,
    PositiveShare,
    changes_of,
)
from gpca.uncertainty.settings import UncertaintySettings

CauseChanges = Annotated[dict, changes_of(CauseSettings, without=("icp", "icp_points"))]


@dataclass(frozen=True)
class Objects:
    """How many points are sampled on each mesh."""

    surface_points: SurfacePoints


@dataclass(frozen=True)
class NoReduction:
    """The reduction ``none`` has no settings."""


@dataclass(frozen=True)
class Reductions:
    """Of embeddings, by name."""

    none: NoReduction = field(default_factory=NoReduction)
    pca: PCA = field(default_factory=PCA)
    umap: UMAP = field(default_factory=UMAP)
    autoencoder: Autoencoder = field(default_factory=Autoencoder)


@dataclass(frozen=True)
class Embedding:
    """What the explainers on embeddings read."""

    encoder: str
    reduction: Literal["none"]


@dataclass(frozen=True)
class Design(UncertaintySettings):
    """A design of Monte-Carlo ICP, on some test samples of each source and seed or on all."""

    samples: Annotated[int, Bounds(minimum=3, multipleOf=3)] = 3


@dataclass(frozen=True, kw_only=True)
class ActiveLearning(ActiveLearningSettings):
    """The experiments with a concept that the classifier has never seen."""

    held_out: Distinct[Concept]
    target: PositiveShare
    rare_share: OpenShare | None = None
    rare_labels: Count = 1
    without: EncoderChanges
    stream: StreamSettings
    strategies: Distinct[str]


@dataclass(frozen=True, kw_only=True)
class NewConcepts(NewConceptSettings):
    """The same where no encoder has seen the samples or the concept, and the encoder that learns without labels."""

    encoder: EncoderChanges


@dataclass(frozen=True, kw_only=True)
class Grid(KernelGrid):
    """Table IV, and the sources that it is made of."""

    sources: Distinct[str]


_SHIFT = changes_of(ShiftSettings, without=("beyond",)).kinds
# An encoder of another width would not fit beside the others.
Shift = Annotated[dict, Keys(_SHIFT | {"encoder": EncoderChanges, "severities": Severities}, required=_SHIFT)]


@dataclass(frozen=True)
class ExplainedModel:
    """What the model of ``python -m gpca explain`` learns from."""

    source: str
    encoder: str
    causes: CauseChanges
    classifier: GPCSettings
    false_alarms: OpenShare


@dataclass(frozen=True)
class Runtime:
    """Of Table VII."""

    repeats: Annotated[int, Bounds(minimum=2)] = 100


@dataclass(frozen=True)
class Figures:
    """The source that the figures of one registration show."""

    source: str
