"""Choices that the paper leaves open, by group, and how much of the data their readings see: nothing needs torch.

``config/readings.yaml`` holds the values that are tried, with a comment on each.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Annotated, Any, Literal

from gpca.classifier.settings import Kernel, LearningRate
from gpca.pairs.reading import Reading as ReadAs
from gpca.settings import Bounds, Count, Distinct, OpenShare, Positive

Quantity = Literal[
    "divergence",
    "divergence_reversed",
    "log_determinant",
    "trace",
    "residual",
    "inlier_rmse",
    "inlier_rmse_of_one",
]
Set = Literal[
    "in_distribution",
    "severity",
    "source",
    "objects",
    "in_distribution+severity",
    "in_distribution+source",
    "seen_objects+objects",
]
Starts = Annotated[int, Bounds(minimum=2)]


@dataclass(frozen=True)
class Sensitivity:
    """The quantity that sensitivity analysis differentiates, and the derivative that names the cause."""

    quantity: Distinct[Quantity]
    sign: Distinct[Literal["signed", "absolute", "lowest"]]
    unit: Distinct[Literal["range", "own"]]
    step: Distinct[Literal["small", "middle"]]


@dataclass(frozen=True)
class Shap:
    """The uncertainty that SHAP explains, and the pair that it is compared with."""

    starts: Distinct[Starts]
    background: Distinct[Literal["observed", "clean"]]
    quantity: Distinct[Literal["divergence", "divergence_reversed", "log_determinant"]]
    floor: Distinct[Positive]
    sign: Distinct[Literal["signed", "absolute"]]


@dataclass(frozen=True)
class TestSeverities:
    """The strength of the test samples' perturbations."""

    part: Distinct[Literal["all", "weakest", "middle", "strongest"]]
    classifier: Distinct[Literal["paper", "converged"]]


@dataclass(frozen=True)
class GPCStart:
    """The start of the Gaussian process classifier."""

    inputs: Distinct[Literal["standardised", "unit_norm", "raw"]]
    inducing: Distinct[Literal["kmeans", "random"]]
    lengthscale: Distinct[Literal["median", "default"]]
    batch: Distinct[Literal["full", "minibatch"]]


@dataclass(frozen=True)
class TableKernel:
    """Kernel and schedule of Table V's classifier."""

    kernel: Distinct[Kernel]
    iterations: Distinct[Count]


@dataclass(frozen=True)
class LinearSVM:
    """The kind of linear support vector machine, and how it gives probabilities."""

    machine: Distinct[Literal["svc", "linear_svc"]]
    inputs: Distinct[Literal["standardised", "raw"]]
    probability: Distinct[Literal["platt", "softmax"]]


@dataclass(frozen=True)
class EncoderHead:
    """The head that trains the encoder, and the inputs of the learners on its embeddings."""

    head: Distinct[Literal["linear", "two_layer"]]
    inputs: Distinct[Literal["standardised", "raw"]]


@dataclass(frozen=True)
class Diagnostics:
    """Samples, distance, uncertainty and area of Table V's diagnostics."""

    set: Distinct[Set]
    distance: Distinct[Literal["knn_analytical", "mahalanobis_analytical", "knn_embedding", "mahalanobis_embedding"]]
    score: Distinct[Literal["max_score", "entropy", "bald"]]
    area: Distinct[Literal["aurc", "auroc_error"]]


@dataclass(frozen=True)
class LabelPool:
    """The pool of samples to be labeled, and the labels at the start and in a round."""

    new_share: Distinct[OpenShare]
    batch: Distinct[Count]
    initial: Distinct[Annotated[int, Bounds(minimum=2)]]


@dataclass(frozen=True)
class Epochs:
    """An epoch as a pass of Adam over these labels, at this rate."""

    learning_rate: Distinct[LearningRate]
    labels: Distinct[Literal["at_target", "all"]]


@dataclass(frozen=True)
class FrameRepeats:
    """The part that varies between repeats on depth frames, and the objects that the test samples show."""

    repeats: Distinct[Literal["everything", "classifiers", "samples"]]
    objects: Distinct[Literal["all", "seen", "unseen"]]


@dataclass(frozen=True)
class FrameInput:
    """The cloud that the encoder sees on depth frames, and the objects that the test samples show."""

    input: Distinct[ReadAs]
    objects: Distinct[Literal["all", "seen", "unseen"]]


@dataclass(frozen=True)
class ClassicFeatures:
    """The classic features that are read."""

    features: Distinct[Literal["all", "no_counts", "no_residual", "residual", "counts"]]


@dataclass(frozen=True)
class ReadingSizes:
    """The seeds and samples that the readings of a run see.

    Attributes:
        seeds: how many of the run's seeds are used, from the first.
        encoders: of these, seeds for which another encoder is trained.
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
