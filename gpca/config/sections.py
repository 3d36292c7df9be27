"""Sections of the config that have keys beyond those of one settings class, in the order of the config."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from gpca.causes.settings import CauseSettings
from gpca.classifier.settings import GPCSettings
from gpca.encoders.reduction import PCA, UMAP, Autoencoder
from gpca.objects.entry import SurfacePoints
from gpca.settings import Bounds, OpenShare, changes_of
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


@dataclass(frozen=True)
class ExplainedModel:
    """What the model of ``python -m gpca explain`` learns from."""

    source: str
    encoder: str
    causes: CauseChanges
    classifier: GPCSettings
    false_alarms: OpenShare


@dataclass(frozen=True)
class Figures:
    """The source that the figures of one registration show."""

    source: str
