"""Readings of a group's choices, and how much of the data they see: nothing here needs torch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Annotated, Any

from gpca.settings import Bounds, Count

ALIGNED = "aligned"  # the cloud that the encoder sees, as ICP left it: the protocol's


@dataclass(frozen=True)
class ReadingSizes:
    """The seeds and samples that the readings of a run see.

    Attributes:
        seeds: how many of the run's seeds are used, from the first.
        encoders: of these, seeds for which other encoders are trained.
        samples: test samples of each source and seed on which Monte-Carlo ICP is run, balanced, at most.
    """

    seeds: Count = 2
    encoders: Annotated[int, Bounds(minimum=0)] = 1
    samples: Annotated[int, Bounds(minimum=3, multipleOf=3)] = 15


Reading = Mapping[str, Any]


def readings_of(choices: Mapping[str, Sequence]) -> list[Reading]:
    """Return every combination of the values of a group's choices."""
    return [dict(zip(choices, values, strict=True)) for values in product(*choices.values())]


def name_of(group: str, reading: Reading) -> str:
    """Return the name of a reading in `table` of its tidy rows, e.g. ``frames/classifiers/seen``."""
    return "/".join([group, *(f"{value:g}" if isinstance(value, float) else str(value) for value in reading.values())])
