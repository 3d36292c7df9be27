"""Re-enactments: one of them as a figure, and what each part of the truth would add to them (docs/reenactment.md)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gpca.errors import require_names
from gpca.experiments.experiment import Experiment, LeftOut, Tidy
from gpca.experiments.reenactment.knowledge import KNOWN
from gpca.settings import Count, Distinct


@dataclass(frozen=True)
class Section:
    """The sources and seeds whose test samples are re-enacted with parts of the truth; the first so many seeds."""

    sources: Distinct[str]
    seeds: Count


def check(config: dict, left_out: LeftOut) -> None:
    """Check the names of the sources."""
    chosen = config["oracles"]["sources"]
    require_names("oracles.sources", chosen, config["sources"], "source", left_out("sources"))


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return what is known, the sources and the seeds."""
    section = config["oracles"]
    return {
        "known": list(KNOWN),
        "oracle_source": list(section["sources"]),
        "oracle_seed": list(config["seeds"])[: section["seeds"]],
    }


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
                "prediction_files": "oracles/{oracle_source}/{known}/seed{oracle_seed}.csv",
                "causes_files": "causes/{oracle_source}/seed{oracle_seed}.npz",
            },
        ),
    ),
    names=names,
    shown=shown,
    check=check,
    lists={"oracles.sources": "sources"},
)
