"""Settings of active learning, in rounds and on a stream, kept apart from its code: nothing here needs torch."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from gpca.classifier.settings import GPCSettings
from gpca.errors import InputError
from gpca.settings import Bounds, Count, Distinct, OpenShare, PositiveShare, fields_of


@dataclass(frozen=True)
class ActiveLearningSettings:
    """How the rounds go; the same for every strategy.

    Attributes:
        initial: labeled samples of the known concepts before the first query, balanced.
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
        own = fields_of(section, cls)
        return cls(**own | ({"gpc": GPCSettings(**own["gpc"])} if "gpc" in own else {}))


LOOK_EVERY = 5  # passes over the labels between looks at the accuracy, where those up to a target are counted


@dataclass(frozen=True)
class RetrainingSettings:
    """How the rounds go in which a classifier is fitted to all labels, as in the paper.

    Attributes:
        labels: the budget of queries, of a pool that may hold fewer.
        least: labels that are given even where the target is reached before; from then on a round has `late_batch`.
        batch, late_batch: B, labels per round.
        gpc: the classifier; by default the paper's.
    """

    labels: Count = 60
    least: Count = 60
    batch: Count = 4
    late_batch: Count = 25
    gpc: GPCSettings = field(default_factory=GPCSettings)


@dataclass(frozen=True)
class RareSettings(RetrainingSettings):
    """The same of a concept that is rare in the pool.

    Attributes:
        shares: of the pool that is of that concept, each in a run of its own.
        beside_seeds: how many of the run's seeds, from the first, have more than the first share; null: all.
    """

    shares: Distinct[OpenShare] = (0.05,)
    beside_seeds: Count | None = None


JUDGED_SHARE = 0.05  # the paper's numbers are compared with the run of this share (docs/comparison.md)


def rare_setting(share: float) -> str:
    """Return the name of that run in a file of curves: ``rare_5`` for a share of 0.05."""
    return f"rare_{100 * share:g}"


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


ALL_LABELS = "all_labels"  # of the pool, at once: what labels can give at most
NEW_CONCEPT_STRATEGIES = ("bald_kmeans", "random", ALL_LABELS)
FROM_OTHERS = {  # embeddings by encoders of other jobs -> what there has to be
    "other_samples": "two seeds or more",
    "other_source": "two sources or more",
}
SeenBy = Literal["other_samples", "other_source", "pair"]
NewCause = Literal["nominal", "geometry"]


@dataclass(frozen=True)
class NewConceptSettings:
    """Settings for learning a concept where no encoder has seen the samples, or the concept, before.

    Attributes:
        seeds: the first so many of the run's.
        embeddings: of the samples: by an encoder that learned from other samples of the same source, or from another
            source; or the descriptors of the pair.
        errors: shares of the oracle's answers that are wrong.
        erring: embeddings with which such an oracle is asked.
        points: drawn from each cloud to describe a pair.
        causes: new concepts where the truth is measured: that nothing is wrong, or that the shape cannot hold the pose.
        geometry_train, geometry_test: samples of the latter, drawn beside those of the other causes, at most.
        geometry_candidates: drawn for them in each split, at most.
    """

    seeds: Count = 3
    embeddings: Distinct[SeenBy] = ("other_samples", "other_source", "pair")
    errors: Distinct[OpenShare] = (0.05, 0.1, 0.2, 0.3)
    erring: Distinct[SeenBy] = ("other_samples", "pair")
    points: Annotated[int, Bounds(minimum=32, maximum=65536)] = 512
    causes: Distinct[NewCause] = ("nominal", "geometry")
    geometry_train: Annotated[int, Bounds(minimum=2)] = 60
    geometry_test: Annotated[int, Bounds(minimum=1)] = 30
    geometry_candidates: Count = 1500

    def __post_init__(self) -> None:
        if missing := set(self.erring) - set(self.embeddings):
            fault = f"'{sorted(missing)[0]}' is not among the embeddings"
            raise InputError("setting erring of new_concepts", fault, f"choose from {', '.join(self.embeddings)}")
