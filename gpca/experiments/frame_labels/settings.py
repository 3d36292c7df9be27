"""Settings of active learning on depth frames, apart from its code: nothing here needs torch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from gpca.active_learning.settings import RetrainingSettings
from gpca.pairs.perturbation import Concept
from gpca.settings import Bounds, Count, Different, Distinct, OpenShare, PositiveShare, fields_of, read_settings

PAIR = "pair"  # the embedding that is measurements of the pair, beside those by the backbones


@dataclass(frozen=True)
class FrameLabelSettings:
    """The settings that differ from those of a rare concept on whole objects.

    Attributes:
        seeds: how many of the run's seeds are used, from the first.
        backbones: those whose embeddings are learned from, where the depth frames have them.
        held_out: the new concepts, in turn.
        initial: labeled samples of the known concepts before the first query, balanced.
        share: of the pool that is of the new concept.
        labels: the budget of queries.
        least: labels that are given even where all targets are reached before.
        targets: accuracies on the test samples to which labels are counted.
        points: drawn from each cloud to describe a pair.
    """

    seeds: Count = 1
    backbones: Annotated[tuple[str, ...], Different(fewest=0)] = ("dgcnn", "pointnet2")
    held_out: Distinct[Concept] = ("overlap",)
    initial: Annotated[int, Bounds(minimum=2)] = 10
    share: OpenShare = 0.05
    labels: Count = 60
    least: Count = 20
    targets: Distinct[PositiveShare] = (0.65, 0.7, 0.75)
    points: Annotated[int, Bounds(minimum=32, maximum=65536)] = 512


def rounds_of(own: FrameLabelSettings, rare: Mapping[str, Any]) -> RetrainingSettings:
    """Return how the rounds go: as those of a concept that is rare on whole objects, with the labels of frames."""
    shared = fields_of(rare, RetrainingSettings)
    return read_settings(RetrainingSettings, shared | {"labels": own.labels, "least": own.least})


def in_percent(target: float) -> str:
    """Return a target as the column `table` of the metrics has it."""
    return f"{100 * target:.0f}"
