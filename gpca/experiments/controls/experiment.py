"""Explanations with a shortcut closed: clouds of one density, unseen objects, wrong labels and the rest (Table X)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from gpca.causes.settings import NOT_OF_CAUSES, CauseSettings
from gpca.errors import InputError, with_key
from gpca.experiments.controls.settings import TRANSFER, UNSEEN, ControlSettings
from gpca.experiments.experiment import EXPLAINERS, ByName, Experiment, LeftOut, Tidy
from gpca.experiments.explained import require_explained, titles
from gpca.explainers.gpca import GPCA_FORMS
from gpca.explainers.interface import BARE
from gpca.explainers.registry import explainer_entry
from gpca.objects.entry import stand_in_clause
from gpca.settings import changes_of


@dataclass(frozen=True, kw_only=True)
class Section(ControlSettings):
    """The controls, and the explainers under them, with settings beyond those that they have elsewhere.

    Attributes:
        hard: how the hard samples are drawn: as the causes, with these changes.
    """

    explainers: ByName
    hard: Annotated[dict, changes_of(CauseSettings, without=NOT_OF_CAUSES)]


def check(config: dict, _left_out: LeftOut) -> None:
    """Check that every explainer finds what it reads under a control, and that hard samples can be drawn."""
    hard = config["causes"] | config["controls"]["hard"]
    with_key("controls.hard", CauseSettings.from_dict, hard, config["registrations"]["icp"])
    for key, name in require_explained(config, "controls.explainers"):
        entry = explainer_entry(name)
        if entry.design and not entry.observed_only:
            fault = "needs more Monte-Carlo ICP than that of the observed pair, which is all that a control runs"
            raise InputError(f"config key {key}", fault, "leave it out")


def names(config: Mapping[str, Any], sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the seeds and controls, the encoders that are compared, and the sources between which there is transfer.

    Encoders are compared on the samples that the unseen objects need; one source alone admits no transfer.
    """
    controls = config["controls"]
    explains_by_gpca = any(name in GPCA_FORMS for name in controls["explainers"])
    return {
        "control_seed": list(config["seeds"])[: controls["seeds"]],
        "control": list(controls["controls"]),
        "control_encoder": list(controls["encoders"]) if explains_by_gpca and UNSEEN in controls["controls"] else [],
        "timed_control": [name for name in controls["explainers"] if explainer_entry(name).reads == BARE],
        "transfer_source": list(sources) if TRANSFER in controls["controls"] and len(sources) > 1 else [],
    }


def shown(config: Mapping[str, Any], sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the titles of the explainers and of all sources, and the names of the controls."""
    titles_of_sources = ", ".join(entry["title"] for entry in sources.values())
    return {
        "control_explainers": titles(config["controls"]["explainers"]),
        "control_sees": {name: explainer_entry(name).sight for name in config["controls"]["explainers"]},
        "controls": list(config["controls"]["controls"]),
        "controls_title": titles_of_sources + stand_in_clause(sources.values()),
    }


CONTROLLED = "controls/{source}/seed{control_seed}.csv"
EXPERIMENT = Experiment(
    name="controls",
    sections={"controls": Section},
    tidy=(
        Tidy(
            "controls.csv",
            "gpca.experiments.controls.metrics:collect",
            {"prediction_files": CONTROLLED},
            rule="control_metrics",
        ),
        Tidy(
            "control_intervals.csv",
            "gpca.experiments.controls.metrics:collect_intervals",
            {"prediction_files": CONTROLLED},
        ),
        Tidy(
            "control_severities.csv",
            "gpca.experiments.controls.severity:collect",
            {"prediction_files": CONTROLLED, "sample_files": "control_samples/{source}/seed{control_seed}.csv"},
            {"severities": "registrations.severities", "bins": "controls.bins", "success": "success.error"},
        ),
    ),
    names=names,
    shown=shown,
    check=check,
    leavable={"controls.explainers": EXPLAINERS},
)
