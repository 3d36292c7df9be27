"""The whole config as one settings class: shared sections, and those of each experiment."""

from dataclasses import dataclass, field, make_dataclass
from functools import cache
from typing import Annotated, Literal

from pydantic import Field

from gpca.alignment.pose_error import SuccessSettings
from gpca.causes.settings import NOT_OF_CAUSES, CauseSettings
from gpca.classifier.settings import GPCSettings
from gpca.comparison.published import UNITS
from gpca.comparison.reference import Allowance
from gpca.comparison.verdicts import Tolerance
from gpca.declarations.experiment import ByName
from gpca.declarations.registry import experiments
from gpca.encoders.reduction import PCA, UMAP, Autoencoder
from gpca.encoders.registry import NamedEncoder
from gpca.objects.entry import Name, Place, SourceEntry, SurfacePoints
from gpca.pairs.synthesis import RegistrationSettings
from gpca.settings import Bounds, Different, Distinct, Keys, OpenShare, changes_of, part_of, required
from gpca.uncertainty.settings import UncertaintySettings

DESIGNS = ("additive", "latin", "saltelli", "oracle", "removal", "causal")  # gpca.uncertainty.designs needs numba


@dataclass(frozen=True)
class Reductions:
    """The reductions of embeddings, by name."""

    none: Annotated[dict, Keys({})] = field(default_factory=dict)
    pca: PCA = field(default_factory=PCA)
    umap: UMAP = field(default_factory=UMAP)
    autoencoder: Autoencoder = field(default_factory=Autoencoder)


@dataclass(frozen=True)
class UncertaintyDesign(UncertaintySettings):
    """A design of Monte-Carlo ICP, and its test samples of each source and seed."""

    samples: Annotated[int, Bounds(minimum=3, multipleOf=3)] = 3


Design = Annotated[dict, changes_of(UncertaintyDesign, without=("icp",))]
ModelCauses = Annotated[dict, changes_of(CauseSettings, without=NOT_OF_CAUSES)]
Role = Literal["development", "evaluation"]
Tolerances = Annotated[dict, Keys(dict.fromkeys(UNITS, Tolerance), required=UNITS)]


@dataclass(frozen=True)
class SharedSections:
    """The sections that experiments share."""

    run: Annotated[str, Field(pattern="^[A-Za-z0-9][A-Za-z0-9_-]*$", max_length=100)]
    data_dir: Place | None
    downloads: Place
    plugins: Annotated[tuple[Place, ...], Different(fewest=0)]
    seeds: Distinct[Annotated[int, Bounds(minimum=0, maximum=2**32 - 1)]]
    objects: Annotated[dict, required(surface_points=SurfacePoints)]
    splits: Annotated[dict, required(objects=Place | None, scenes=Place | None, role=Role)]
    success: SuccessSettings
    registrations: Annotated[dict, part_of(RegistrationSettings)]
    encoders: Annotated[dict[Name, NamedEncoder], Field(min_length=1)]
    reductions: Reductions
    embedding: Annotated[dict, required(encoder=str, reduction=Literal["none"])]
    uncertainty: Annotated[dict, Keys(dict.fromkeys(DESIGNS, Design), required=("causal",))]
    causes: Annotated[dict, part_of(CauseSettings, without=NOT_OF_CAUSES)]
    explainers: ByName
    model: Annotated[  # of `gpca explain`
        dict, required(source=str, encoder=str, causes=ModelCauses, classifier=GPCSettings, false_alarms=OpenShare)
    ]
    comparison: Annotated[dict, required(tolerances=Tolerances)]
    reference: Allowance
    figures: Annotated[dict, required(source=str)]  # of one registration
    sources: Annotated[dict[Name, SourceEntry], Field(min_length=1)]


@cache
def whole_config() -> type:
    """Return the settings class of a config."""
    sections = [(name, kind, field()) for experiment in experiments() for name, kind in experiment.sections.items()]
    return make_dataclass("Config", sections, bases=(SharedSections,), frozen=True, kw_only=True)
