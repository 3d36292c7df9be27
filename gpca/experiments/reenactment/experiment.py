"""Re-enactments: one of them as a figure, and what each part of the truth would add to them (docs/reenactment.md)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gpca.experiments.experiment import Experiment, Tidy
from gpca.experiments.reenactment.knowledge import KNOWN
from gpca.settings import Count


@dataclass(frozen=True)
class Section:
    """The seeds whose test samples are re-enacted with parts of the truth: the first so many of the run's."""

    seeds: Count


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return what is known, and the seeds."""
    return {"known": list(KNOWN), "oracle_seed": list(config["seeds"])[: config["oracles"]["seeds"]]}


def shown(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the settings of the re-enactments."""
    return {"reenactment_settings": config["diagnosis"]["reenactment"]}


EXPERIMENT = Experiment(
    name="reenactment",
    sections={"oracles": Section},
    tidy=(
        Tidy(
            "oracle_intervals.csv",
            "gpca.experiments.reenactment.metrics:collect_oracles",
            {
                "prediction_files": "oracles/{source}/{known}/seed{oracle_seed}.csv",
                "causes_files": "causes/{source}/seed{oracle_seed}.npz",
            },
        ),
    ),
    names=names,
    shown=shown,
)
