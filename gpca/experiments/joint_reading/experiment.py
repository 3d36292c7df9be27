"""One reading of all that the paper leaves open together: what one consistent protocol reproduces (Table XVI)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from gpca.errors import InputError
from gpca.experiments.experiment import Experiment, LeftOut, Tidy
from gpca.experiments.joint_reading.choices import PROTOCOL, SEVERITIES, Grid
from gpca.objects.entry import Name, NamedSource, title_of
from gpca.settings import Bounds, Count

DevelopmentSeed = Annotated[int, Bounds(minimum=100)]  # no other run has them


@dataclass(frozen=True, kw_only=True)
class Section:
    """How a joint reading is searched.

    Attributes:
        source: name of the development objects, in no row of any table.
        objects: where they come from, as an entry of `sources`.
        stands_for: the source whose printed numbers it is compared with.
        seeds: those of development; none for a run without a joint reading.
        samples: test samples of each source and seed on which Monte-Carlo ICP is run, balanced, at most.
        batch, labels: labels of a round, and in all.
        deals: of the printed numbers, for the chance.
        choices: the values of each choice, the protocol's first.
    """

    source: Name
    objects: NamedSource
    stands_for: Name
    seeds: tuple[DevelopmentSeed, ...]
    samples: Annotated[int, Bounds(minimum=3, multipleOf=3)]
    batch: Count
    labels: Count
    deals: Count
    choices: Grid


def check(config: dict, _left_out: LeftOut) -> None:
    """Check that there are encoders of all severities, and that the development objects are nobody else's."""
    section = config["joint_reading"]
    if not section["seeds"]:
        return
    if section["source"] in config["sources"]:
        fault = f"'{section['source']}' is a source of the run too"
        raise InputError("config key joint_reading.source", fault, "set joint_reading.seeds: []")
    if set(section["choices"][SEVERITIES]) - {PROTOCOL} and not config["readings"]["encoders"]:
        fault = "needs encoders that learn from other severities"
        raise InputError("config key joint_reading.choices.severities", fault, "raise readings.encoders")


def names(config: Mapping[str, Any], sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return seeds, source and severities of development; none where the source that they stand for is left out."""
    section = config["joint_reading"]
    is_run = section["stands_for"] in sources and bool(section["seeds"])
    return {
        "development_seed": list(section["seeds"]) if is_run else [],
        "development_source": [section["source"]] if is_run else [],
        "joint_severities": list(section["choices"][SEVERITIES]) if is_run else [],
    }


def shown(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the title of the development objects."""
    entry = config["joint_reading"]["objects"]
    return {"development_title": title_of({"stand_in": entry["kind"] == "procedural"} | entry)}


EXPERIMENT = Experiment(
    name="joint_reading",
    sections={"joint_reading": Section},
    tidy=(
        Tidy("joint_scores.csv", rule="judge_joint"),
        Tidy("joint_verdicts.csv", rule="judge_joint"),
    ),
    needs=("development_seed",),
    names=names,
    shown=shown,
    check=check,
)
