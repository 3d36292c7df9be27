"""A guarantee for what is said about causes: promised and measured errors of sets and of an alarm (Table XIX)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gpca.errors import InputError, require_names
from gpca.experiments.experiment import Experiment, LeftOut, Tidy
from gpca.experiments.guarantee.settings import GuaranteeSettings
from gpca.explainers.interface import REENACTED
from gpca.explainers.registry import CAUSES, explainer_entry
from gpca.settings import Distinct

LEARNED_ANEW = ("descriptors", REENACTED)  # what explainers read that are learned again, on one part of the families
EMBEDDINGS = "embeddings"  # of encoders; explainers of these are asked as they are


@dataclass(frozen=True, kw_only=True)
class Section(GuaranteeSettings):
    """The promises, and the explainers of causes that they are made for."""

    explainers: Distinct[str]


def check(config: dict, left_out: LeftOut) -> None:
    """Check that the explainers are among those of the diagnosis, and read what is kept in files."""
    chosen, known = config["guarantee"]["explainers"], config["diagnosis"]["explainers"]
    require_names("guarantee.explainers", chosen, known, "explainer", left_out("diagnosis.explainers"))
    for name in chosen:
        if explainer_entry(name, CAUSES).reads not in (*LEARNED_ANEW, EMBEDDINGS):
            fault = f"explainer '{name}' reads neither descriptors nor re-enactments nor embeddings"
            raise InputError("config key guarantee.explainers", fault, "leave it out")


def promises(section: Mapping[str, Any]) -> dict[str, Any]:
    """Return the section without the names of the explainers."""
    return {name: value for name, value in section.items() if name != "explainers"}


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the explainers."""
    return {"guaranteed": list(config["guarantee"]["explainers"])}


def shown(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the titles of the explainers, and what is promised."""
    chosen = config["guarantee"]["explainers"]
    titles = {name: explainer_entry(name, CAUSES).title for name in chosen}
    return {"guarantee_explainers": titles, "guarantee_promises": promises(config["guarantee"])}


EXPERIMENT = Experiment(
    name="guarantee",
    sections={"guarantee": Section},
    tidy=(
        Tidy(
            "guarantee.csv",
            "gpca.experiments.guarantee.metrics:collect",
            {"score_files": "guarantee/{guaranteed}.csv"},
            {"section": "guarantee"},
            rule="guarantee_metrics",
        ),
    ),
    names=names,
    shown=shown,
    check=check,
    lists={"guarantee.explainers": "diagnosis.explainers"},
)
