"""Classifiers on samples unlike those of the training, and how useful their uncertainty is (Table V)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from gpca.encoders.registry import EncoderChanges, require_draws
from gpca.errors import InputError
from gpca.experiments.experiment import ByName, Experiment, LeftOut, Names, Tidy
from gpca.experiments.explained import require_explained
from gpca.experiments.out_of_distribution.settings import ShiftSettings
from gpca.explainers.registry import explainer_entry, explainers
from gpca.pairs.perturbation import Severities
from gpca.settings import Keys, changes_of

_SHIFT = changes_of(ShiftSettings, without=("beyond",)).kinds
# An encoder of another width would not fit beside the others.
Shift = Annotated[dict, Keys(_SHIFT | {"encoder": EncoderChanges, "severities": Severities}, required=_SHIFT)]


def check(config: dict, _left_out: LeftOut) -> None:
    """Check that the samples can be drawn, and that every learner reads embeddings."""
    shift, registrations = config["shift"], config["registrations"]
    encoder = config["encoders"][config["embedding"]["encoder"]] | shift["encoder"]
    require_draws("shift.encoder", encoder, registrations["cloud_points"], "registrations.cloud_points")
    for key, name in require_explained(config, "learners"):
        if explainer_entry(name).reads != "embeddings":
            raise InputError(f"config key {key}", "does not read embeddings", "choose another")
    entries = {"shift": shift, **{f"learners.{name}": entry or {} for name, entry in config["learners"].items()}}
    for key, entry in entries.items():
        if (neighbors := entry.get("neighbours", 0)) > registrations["train"]:
            fault = f"{neighbors} neighbors are too many for {registrations['train']} training samples"
            raise InputError(f"config key {key}.neighbours", fault, "lower it, or raise registrations.train")


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the learners."""
    return {"learner": list(config["learners"])}


def shown(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the titles of the learners."""
    titles = {name: explainer_entry(name).title for name in config["learners"]}
    return {"learners": {name: title.removesuffix(" on the embedding") for name, title in titles.items()}}


EXPERIMENT = Experiment(
    name="out_of_distribution",
    sections={"learners": ByName, "shift": Shift},
    tidy=(
        Tidy(
            "diagnostics.csv",
            "gpca.experiments.out_of_distribution.metrics:collect_diagnostics",
            {
                "prediction_files": "learners/{source}/{learner}/seed{seed}.csv",
                "set_files": "shifted/{source}/seed{seed}.npz",
            },
        ),
        Tidy(
            "learner_intervals.csv",
            "gpca.experiments.out_of_distribution.intervals:collect_intervals",
            {
                "prediction_files": "learners/{source}/{learner}/seed{seed}.csv",
                "set_files": "shifted/{source}/seed{seed}.npz",
            },
        ),
    ),
    names=names,
    shown=shown,
    check=check,
    leavable={"learners": Names("learner", explainers)},
)
