"""Settings of active learning, in rounds and on a stream, apart from its code: nothing here needs torch."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Annotated

from gpca.classifier.settings import GPCSettings
from gpca.settings import Bounds, Count, PositiveShare


@dataclass(frozen=True)
class ActiveLearningSettings:
    """How the rounds go; the same for every strategy.

    Attributes:
        initial: labelled samples of the known concepts before the first query, balanced.
        labels: L, the budget of queries.
        batch: B, labels per round.
        iterations, tolerance: the most passes over the labels in a retraining, and when it ends before.
        gpc: the classifier that knows two concepts; its kernel and inducing inputs stay from then on.
    """

    initial: Annotated[int, Bounds(minimum=2)] = 120
    labels: Count = 60
    batch: Count = 4
    iterations: Count = 100
    tolerance: PositiveShare = 1e-3
    gpc: GPCSettings = field(default_factory=lambda: GPCSettings(learning_rate=0.1))

    @classmethod
    def from_dict(cls, section: dict) -> ActiveLearningSettings:
        """Build from the config's section ``active_learning``, of which other parts read the rest."""
        own = {field.name: section[field.name] for field in fields(cls) if field.name in section}
        return cls(**own | ({"gpc": GPCSettings(**own["gpc"])} if "gpc" in own else {}))


@dataclass(frozen=True)
class StreamSettings:
    """How samples arrive and how many labels may be asked for.

    Attributes:
        arrivals: length of the stream.
        quiet: arrivals before the first of the new concept; after them it is a third of what arrives.
        budget: share of the arrivals that may be asked about; a threshold keeps to it on average.
        window: arrivals whose BALD sets the threshold, and over which the running accuracy is taken.
        every: arrivals between two rows of the result.
    """

    arrivals: Annotated[int, Bounds(minimum=2)] = 300
    quiet: Count = 60
    budget: PositiveShare = 0.1
    window: Annotated[int, Bounds(minimum=2)] = 50
    every: Count = 10
