"""Settings of active learning, without torch."""

from dataclasses import dataclass, field
from typing import Annotated, Self

from gpca.classifier.settings import GPCSettings
from gpca.pairs.perturbation import Concept
from gpca.settings import Bounds, Count, Different, Distinct, OpenShare, PositiveShare, fields_of


@dataclass(frozen=True)
class ActiveLearningSettings:
    """Rounds of labeling, equal for every strategy."""

    initial: Annotated[int, Bounds(minimum=2)] = 120  # labels of the other concepts, balanced
    labels: Count = 60  # L, the budget
    batch: Count = 4  # B, labels of a round
    iterations: Count = 100  # at most, passes over the labels in a retraining
    tolerance: PositiveShare = 1e-3  # at which a retraining has converged
    # The initial classifier; its kernel and inducing inputs are kept.
    gpc: GPCSettings = field(default_factory=lambda: GPCSettings(learning_rate=0.1))

    @classmethod
    def from_dict(cls, section: dict) -> Self:
        """Build from the config's section ``active_learning``, which also has other keys."""
        fields = fields_of(section, cls)
        return cls(**fields | ({"gpc": GPCSettings(**fields["gpc"])} if "gpc" in fields else {}))


LOOK_EVERY = 5  # passes over the labels between evaluations, when passes up to a target are counted


@dataclass(frozen=True)
class RetrainingSettings:
    """Rounds of labeling with a full fit of the classifier, as in the paper."""

    labels: Count = 60  # the budget; the pool may be smaller
    least: Count = 60  # even if the target is reached earlier
    batch: Count = 4
    late_batch: Count = 25  # of rounds after the least labels
    gpc: GPCSettings = field(default_factory=GPCSettings)


@dataclass(frozen=True)
class RareSettings(RetrainingSettings):
    """Rounds of labeling for a concept that is rare in the pool."""

    shares: Distinct[OpenShare] = (0.05,)  # of the concept in the pool, one run each
    beside_seeds: Count | None = None  # number of seeds with more than the first share; null: all


JUDGED_SHARE = 0.05  # the paper's numbers are compared with the run of this share (docs/comparison.md)


def rare_setting(share: float) -> str:
    """The name in files of curves, such as ``rare_5``."""
    return f"rare_{100 * share:g}"


@dataclass(frozen=True)
class StreamSettings:
    """Arrivals of a stream and its budget of labels."""

    arrivals: Annotated[int, Bounds(minimum=2)] = 300
    quiet: Count = 60  # arrivals before the new concept, which is a third of the later ones
    budget: PositiveShare = 0.1  # share of labeled arrivals, on average
    window: Annotated[int, Bounds(minimum=2)] = 50  # arrivals for the threshold on BALD and for the running accuracy
    every: Count = 10  # arrivals per row of the result


ALL_LABELS = "all_labels"  # the whole pool at once, an upper bound
PAIR = "pair"  # embedding of a depth frame that consists of measurements of the pair
FRAME_STRATEGIES = ("bald_kmeans", "random", ALL_LABELS)
Points = Annotated[int, Bounds(minimum=32, maximum=65536)]


@dataclass(frozen=True)
class FrameLabelSettings:
    """Learning a new concept on depth frames, where it differs from a concept that is rare on whole objects."""

    seeds: Count = 1
    # Encoders whose embeddings are learned from, if the depth frames have them.
    backbones: Annotated[tuple[str, ...], Different(fewest=0)] = ("dgcnn", "pointnet2")
    held_out: Distinct[Concept] = ("overlap",)  # the new concepts, in turn
    initial: Annotated[int, Bounds(minimum=2)] = 10  # labels of the other concepts, balanced
    share: OpenShare = 0.05  # of the new concept in the pool
    labels: Count = 60
    least: Count = 20  # labels, even if all targets are reached earlier
    targets: Distinct[PositiveShare] = (0.65, 0.7, 0.75)  # accuracies on the test samples to which labels are counted
    points: Points = 512
