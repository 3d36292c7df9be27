"""The config's JSON schema, made from the settings classes: `python -m gpca.config.schema` writes it.

The file is kept, since every step reads it and none shall import all settings classes for that. With ``--check``
nothing is written: the command fails where the file differs from what the classes say.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from typing import Annotated, Any

import yaml

from gpca.causes.settings import CauseSettings
from gpca.comparison.published import UNITS
from gpca.comparison.verdicts import Tolerance
from gpca.config import sections
from gpca.config.explainer_section import CAUSE_EXPLAINERS, EXPLAINERS
from gpca.config.json_schema import COMPLETE, EVERY, Keys, Named, schema_of
from gpca.config.robot_sections import RealWorld, Recovery
from gpca.config.source_section import NAME, Place, Source
from gpca.encoders.settings import OPTIONS, EncoderSettings
from gpca.errors import InputError
from gpca.experiments.controls.settings import ControlSettings
from gpca.experiments.experiment import Experiment
from gpca.experiments.frame_labels.settings import FrameLabelSettings
from gpca.experiments.registration_methods.settings import EstimatorPairSettings, PairSettings
from gpca.experiments.registry import experiments
from gpca.experiments.specification_curve.registry import GROUPS
from gpca.experiments.specification_curve.settings import ReadingSizes
from gpca.features.settings import DescriptorSettings
from gpca.io.files import whole_file
from gpca.pairs.synthesis import RegistrationSettings
from gpca.settings import SCHEMA, Bounds

HEAD = "# Made from the settings classes by `python -m gpca.config.schema`: change these and regenerate it.\n"
DESIGNS = ("additive", "latin", "saltelli", "oracle", "removal", "causal")  # gpca.uncertainty.designs needs numba
Settings = dict | None  # of what checks its settings itself


def _options_by_backbone() -> list[dict[str, Any]]:
    """Return the conditions on an encoder's options; a backbone without one checks them itself, when it is made."""
    conditions = []
    for backbone, options in OPTIONS.items():
        chosen: dict[str, Any] = {"properties": {"backbone": {"const": backbone}}}
        if backbone != EncoderSettings.backbone:
            chosen["required"] = ["backbone"]
        conditions.append({"if": chosen, "then": {"properties": {"options": schema_of(options)}}})
    return conditions


Encoder = Annotated[EncoderSettings, Keys(required=("backbone",)), Bounds(allOf=_options_by_backbone())]
_OF_MESHES = {"required": ["kind"], "properties": {"kind": {"const": "mesh_folder"}}}
NamedSource = Annotated[
    dict,
    Bounds(
        **{"$ref": "#/$defs/source"},
        required=["title", "kind"],
        **{"if": _OF_MESHES, "then": {"required": ["unit"]}},
    ),
]
Tolerances = Annotated[dict[str, Tolerance], Named(dict.fromkeys(UNITS, Tolerance), closed=True)]
BY_NAME = Bounds(minProperties=1, propertyNames=NAME)
EXPLAINED = Annotated[dict[str, Settings], BY_NAME, Named(EXPLAINERS)]
SHIFT = Keys(
    required=("samples", "severities", "held_out_share", "encoder", "neighbours", "shape_points"), without=("beyond",)
)
COMPLETE_CAUSES = Keys(required=EVERY, without=("icp", "icp_points"))
GRID = Keys(required=("sources", "kernels", "learning_rates", "iterations"))
LEARNING = Keys(
    required=(
        *("held_out", "initial", "labels", "batch", "target", "iterations", "tolerance"),
        *("without", "stream", "strategies"),
    )
)


@dataclass(frozen=True)
class Comparison:
    """Verdicts on the numbers that the paper prints, by unit."""

    tolerances: Tolerances


@dataclass(frozen=True)
class Diagnosis:
    """What says why the registrations of ``causes`` failed."""

    descriptors: Annotated[DescriptorSettings, COMPLETE]
    encoder: Encoder
    explainers: Annotated[dict[str, Settings], BY_NAME, Named(CAUSE_EXPLAINERS)]


@dataclass(frozen=True, kw_only=True)
class Controls(ControlSettings):
    """The controls, and the explainers under them, with settings beyond those that they have elsewhere."""

    explainers: EXPLAINED


@dataclass(frozen=True, kw_only=True)
class Readings(ReadingSizes):
    """What the paper leaves unstated, by group, and how much of the data the readings see.

    Attributes:
        frame_seeds: the first so many of the run's, for which encoders of depth frames that see other clouds are
            trained.
    """

    frame_seeds: Annotated[int, Bounds(minimum=0)]
    groups: Annotated[
        dict,
        Named({name: group.choices for name, group in GROUPS.items()}),
        Bounds(additionalProperties=False, minProperties=1),
    ]


@dataclass(frozen=True)
class Config:
    """Configuration of GP-CA Bench: all its sections."""

    run: Annotated[str, Bounds(pattern="^[A-Za-z0-9][A-Za-z0-9_-]*$", maxLength=100)]
    data_dir: Place | None
    downloads: Place
    seeds: tuple[Annotated[int, Bounds(minimum=0, maximum=2**32 - 1)], ...]
    objects: sections.Objects
    registrations: Annotated[RegistrationSettings, COMPLETE]
    encoders: Annotated[dict[str, Encoder], BY_NAME]
    reductions: sections.Reductions
    embedding: sections.Embedding
    uncertainty: Annotated[
        dict[str, Annotated[sections.Design, Keys(without=("icp",))]],
        Bounds(propertyNames={"enum": list(DESIGNS)}, required=["causal"]),
    ]
    method_pairs: Annotated[PairSettings, COMPLETE]
    methods: Annotated[dict[str, Settings], BY_NAME]
    estimators: Annotated[dict[str, Settings], BY_NAME]
    estimator_pairs: Annotated[EstimatorPairSettings, COMPLETE]
    causes: Annotated[CauseSettings, COMPLETE_CAUSES]
    diagnosis: Diagnosis
    explainers: EXPLAINED
    active_learning: Annotated[sections.ActiveLearning, LEARNING]
    new_concepts: Annotated[sections.NewConcepts, Keys(required=EVERY)]
    kernel_grid: Annotated[sections.Grid, GRID]
    learners: Annotated[dict[str, Settings], BY_NAME]
    controls: Annotated[Controls, Keys(required=EVERY)]
    shift: Annotated[sections.Shift, SHIFT]
    readings: Annotated[Readings, Keys(required=EVERY)]
    real_world: RealWorld
    frame_labels: Annotated[FrameLabelSettings, COMPLETE]
    model: sections.ExplainedModel
    runtime: sections.Runtime
    recovery: Recovery
    comparison: Comparison
    reference: sections.Reference
    figures: sections.Figures
    sources: Annotated[dict[str, NamedSource], BY_NAME]


def schema_text() -> str:
    """Return the schema file's text."""
    whole = schema_of(Config)
    for experiment in experiments():
        for name, settings in experiment.sections.items():
            whole["required"].append(name)
            whole["properties"][name] = _section_of(experiment, name, settings)
    schema = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Configuration of GP-CA Bench",
        **whole,
        "$defs": {"source": schema_of(Source)},
    }
    return HEAD + yaml.dump(
        schema, Dumper=_WithoutAliases, sort_keys=False, default_flow_style=None, width=120, allow_unicode=True
    )


def _section_of(experiment: Experiment, name: str, settings: Any) -> dict[str, Any]:
    section = schema_of(settings, COMPLETE)
    if f"{name}.explainers" in experiment.leavable:
        section["required"].append("explainers")
        section["properties"]["explainers"] = schema_of(EXPLAINED)
    return section


class _WithoutAliases(yaml.SafeDumper):
    def ignore_aliases(self, data: Any) -> bool:
        """Write what stands in several places in each of them."""
        return True


def main(arguments: list[str] | None = None) -> None:
    """Write the schema, or check that it is what the classes say.

    Raises:
        InputError: with ``--check``, of a file that is something else.
    """
    parser = argparse.ArgumentParser(prog="python -m gpca.config.schema", description=__doc__.split("\n")[0])
    parser.add_argument("--check", action="store_true", help="write nothing; fail if the file differs")
    if not parser.parse_args(arguments).check:
        with whole_file(SCHEMA) as partial:
            partial.write_text(schema_text(), encoding="utf-8")
    elif SCHEMA.read_text(encoding="utf-8") != schema_text():
        raise InputError(SCHEMA.name, "does not match the settings classes", "run 'python -m gpca.config.schema'")


if __name__ == "__main__":
    try:
        main()
    except InputError as fault:
        sys.exit(f"gpca: {fault}")
