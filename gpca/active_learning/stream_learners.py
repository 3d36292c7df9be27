"""The two stream learners that the paper names beside GP-CA, on the same embeddings.

Each has the part of a GPC's interface that a stream uses. All start from the same labeled samples, ask by the same
budget manager and get the same labels, one at a time; they differ in the learner and in its measure of uncertainty.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from gpca.active_learning.bayesian_layer import BayesianLayer
from gpca.active_learning.mondrian import MondrianForest
from gpca.active_learning.rounds import LabelingTask
from gpca.attribution.scores import entropy
from gpca.classifier.latents import Projection
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator

TREES = 10
DEVIATION = 3.0  # of a logit by the prior; both numbers are of development seed 100 of YCB
DRAWS = 30  # of the weights, CLEVER's number


class StreamLearner(Protocol):
    """The interface of the learners of a stream."""

    classes: tuple[str, ...]

    def attribute(self, h: Projection) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return scores (N, C), their variances (N, C), and how much each sample (N,) is worth a label."""

    def scores(self, h: Projection) -> np.ndarray:
        """Return the scores alone."""

    def update(self, h: Projection, labels: np.ndarray, iterations: int, tolerance: float) -> int:
        """Learn further labels."""


class MondrianLearner:
    """A Mondrian forest, as Narr et al. (2016) learn objects from a stream; worth asking is its predictive entropy.

    What they add to the forest is not in it, and the threshold on the entropy is the budget manager's.
    """

    classes = CONCEPTS

    def __init__(self, task: LabelingTask[Projection], *axes: object) -> None:
        self._forest = MondrianForest(len(self.classes), generator(*axes, "mondrian"), TREES)
        self.update(task.initial.h, task.initial.concept_N)

    def attribute(self, h: Projection) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return scores, no variances, and the entropy of the scores."""
        scores_N_C = self.scores(h)
        return scores_N_C, np.full(scores_N_C.shape, np.nan), entropy(scores_N_C)

    def scores(self, h: Projection) -> np.ndarray:
        """Return the scores."""
        return self._forest.scores(h.inputs_N_d)

    def update(self, h: Projection, labels: np.ndarray, *_passes: float) -> int:
        """Let every tree grow."""
        self._forest.learn(h.inputs_N_d, _numbers(labels))
        return 1


class LayerLearner:
    """A Bayesian layer on the frozen encoder, after CLEVER (Lee et al. 2025); worth asking is a lack of confidence.

    CLEVER's network has Laplace's approximation, its prior is what it learned before, and it asks for a demonstration
    of what it is not confident of. Here one linear layer stands for its progressive columns, the known concepts for
    the data of its prior, one label for a demonstration, and the budget manager for its thresholds.
    """

    classes = CONCEPTS

    def __init__(self, task: LabelingTask[Projection], *axes: object) -> None:
        self._layer = BayesianLayer(task.initial.h.inputs_N_d.shape[1], len(self.classes), DEVIATION)
        self._normal_M_C = generator(*axes, "layer").normal(size=(DRAWS, len(self.classes)))
        self.update(task.initial.h, task.initial.concept_N)

    def attribute(self, h: Projection) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return scores, their variances, and one minus the largest score."""
        scores_N_C, variances_N_C, _ = self._layer.attribute(h.inputs_N_d, self._normal_M_C)
        return scores_N_C, variances_N_C, 1 - scores_N_C.max(axis=1)

    def scores(self, h: Projection) -> np.ndarray:
        """Return the scores."""
        return self.attribute(h)[0]

    def update(self, h: Projection, labels: np.ndarray, *_passes: float) -> int:
        """Make the belief before the prior of the one after."""
        self._layer.learn(h.inputs_N_d, _numbers(labels))
        return 1


def _numbers(labels: np.ndarray) -> np.ndarray:
    return np.array([CONCEPTS.index(label) for label in labels])


LEARNERS: dict[str, Callable[..., StreamLearner]] = {"stream_narr": MondrianLearner, "stream_clever": LayerLearner}
