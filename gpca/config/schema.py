"""The whole config as one settings class: the sections that all share, and one of each experiment."""

from __future__ import annotations

from dataclasses import dataclass, field, make_dataclass
from functools import cache
from typing import Annotated

from pydantic import Field

from gpca.causes.settings import CauseSettings
from gpca.comparison.published import UNITS
from gpca.comparison.reference import Allowance
from gpca.comparison.verdicts import Tolerance
from gpca.config import sections
from gpca.encoders.settings import NamedEncoder
from gpca.experiments.experiment import ByName
from gpca.experiments.registry import experiments
from gpca.objects.entry import Name, NamedSource, Place
from gpca.pairs.synthesis import RegistrationSettings
from gpca.settings import Bounds, Distinct, Keys, changes_of, part_of

DESIGNS = ("additive", "latin", "saltelli", "oracle", "removal", "causal")  # gpca.uncertainty.designs needs numba
Design = Annotated[dict, changes_of(sections.Design, without=("icp",))]


@dataclass(frozen=True)
class Comparison:
    """Verdicts on the numbers that the paper prints, by unit."""

    tolerances: Annotated[dict, Keys(dict.fromkeys(UNITS, Tolerance), required=UNITS)]


@dataclass(frozen=True)
class Sections:
    """The sections that are no experiment's own."""

    run: Annotated[str, Field(pattern="^[A-Za-z0-9][A-Za-z0-9_-]*$", max_length=100)]
    data_dir: Place | None
    downloads: Place
    seeds: Distinct[Annotated[int, Bounds(minimum=0, maximum=2**32 - 1)]]
    objects: sections.Objects
    registrations: Annotated[dict, part_of(RegistrationSettings)]
    encoders: Annotated[dict[Name, NamedEncoder], Field(min_length=1)]
    reductions: sections.Reductions
    embedding: sections.Embedding
    uncertainty: Annotated[dict, Keys(dict.fromkeys(DESIGNS, Design), required=("causal",))]
    causes: Annotated[dict, part_of(CauseSettings, without=("icp", "icp_points"))]
    explainers: ByName
    model: sections.ExplainedModel
    comparison: Comparison
    reference: Allowance
    figures: sections.Figures
    sources: Annotated[dict[Name, NamedSource], Field(min_length=1)]


@cache
def whole_config() -> type:
    """Return the settings class of a config."""
    own = [(name, kind, field()) for experiment in experiments() for name, kind in experiment.sections.items()]
    return make_dataclass("Config", own, bases=(Sections,), frozen=True, kw_only=True)
