"""Settings of the learning curve: nothing here needs the code that runs it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from gpca.causes.drawing import apportion
from gpca.causes.truth import BORDERLINE, GEOMETRY
from gpca.classifier.settings import GPCSettings
from gpca.settings import Bounds, Count, Distinct

FEWEST = 20  # training samples of a learner
GROUPS = ("distances", "planes", "motion", "starts")  # of the descriptors, those that need no further registration


@dataclass(frozen=True)
class CurveSettings:
    """The training samples, and the learners of them.

    Attributes:
        seeds: how many of the run's seeds, from the first.
        further: training samples that are drawn beside those of the causes, of the same objects, each with a label.
        chunk: how many of them a job draws, at most.
        sizes: numbers of labeled training samples that are learned from.
        orders: orders of the samples in which each size is the first so many, for means.
        classifier: of GP-CA.
    """

    seeds: Count = 1
    further: Annotated[int, Bounds(minimum=12)] = 240
    chunk: Annotated[int, Bounds(minimum=12)] = 600
    sizes: Distinct[Annotated[int, Bounds(minimum=FEWEST)]] = (50, 100, 200)
    orders: Count = 3
    classifier: GPCSettings = field(default_factory=GPCSettings)

    def chunks(self) -> list[int]:
        """Return the sizes of the chunks, of which none is smaller than needed to fill all groups."""
        count = -(-self.further // self.chunk)
        return [self.further // count + (number < self.further % count) for number in range(count)]


def labeled_samples(causes: Mapping[str, Any]) -> int:
    """Return how many training samples of the config's section ``causes`` have a label."""
    parts = apportion(causes["train"], causes["shares"])
    return causes["train"] - parts[BORDERLINE] - parts[GEOMETRY]
