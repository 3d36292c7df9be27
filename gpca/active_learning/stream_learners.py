"""The two stream learners that the paper names beside GP-CA, on the same embeddings.

Each has the part of a GPC's interface that a stream uses. All start from the same labeled samples, ask by the same
budget manager and get the same labels, one at a time; they differ in the learner and in its measure of uncertainty.

One of them is a Bayesian last layer that learns label by label: the posterior after one label is the prior of the next.
It is softmax regression on fixed features, with Laplace's approximation of the posterior and its generalized
Gauss-Newton curvature (Daxberger et al. 2021). A label changes the curvature by a matrix of rank C, so that the logits
of its sample settle the new weights in C dimensions (the extended Kalman filter of Bayesian continual learning).
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations_with_replacement
from typing import Protocol

import numpy as np
from scipy.special import softmax

from gpca.active_learning.mondrian import MondrianForest
from gpca.active_learning.rounds import LabelingTask
from gpca.attribution.scores import entropy, summarize_draws
from gpca.classifier.latents import Projection
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator

NEWTON_STEPS = 20
TOLERANCE = 1e-10  # of a logit
TREES = 10
DEVIATION = 3.0  # of a logit by the prior; both numbers are of development seed 100 of YCB
DRAWS = 30  # of the weights, CLEVER's number


class BayesianLayer:
    """Weights (C, F) with a Gaussian belief over all of them.

    Args:
        width: F - 1; a constant is added to the features.
        classes: C.
        deviation: of a logit by the prior, where the features have unit variance.
    """

    def __init__(self, width: int, classes: int, deviation: float) -> None:
        self._mean_C_F = np.zeros((classes, width + 1))
        size = classes * (width + 1)
        self._covariance_P_P = np.eye(size) * (deviation**2 / (width + 1))

    def learn(self, x_N_D: np.ndarray, label_N: np.ndarray) -> None:
        """Learn samples and their classes, one after the other."""
        for features_F, label in zip(_with_constant(x_N_D), label_N, strict=True):
            self._learn(features_F, int(label))

    def logits(self, x_N_D: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return mean (N, C) and covariance (N, C, C) of the logits of samples."""
        features_N_F = _with_constant(x_N_D)
        classes, width = self._mean_C_F.shape
        spread_C_F_C_F = self._covariance_P_P.reshape(classes, width, classes, width)
        covariance_N_C_C = np.empty((len(features_N_F), classes, classes))
        for c, d in combinations_with_replacement(range(classes), 2):
            half_N_F = features_N_F @ spread_C_F_C_F[c, :, d]
            covariance_N_C_C[:, c, d] = covariance_N_C_C[:, d, c] = np.einsum("nf,nf->n", half_N_F, features_N_F)
        return features_N_F @ self._mean_C_F.T, covariance_N_C_C

    def attribute(self, x_N_D: np.ndarray, normal_M_C: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return scores, variances and BALD of samples from draws of their logits by standard normal numbers."""
        mean_N_C, covariance_N_C_C = self.logits(x_N_D)
        root_N_C_C = np.linalg.cholesky(covariance_N_C_C + 1e-9 * np.eye(covariance_N_C_C.shape[1]))
        return summarize_draws(mean_N_C + np.einsum("ncd,md->mnc", root_N_C_C, normal_M_C))

    def _learn(self, features_F: np.ndarray, label: int) -> None:
        classes, width = self._mean_C_F.shape
        before_C = self._mean_C_F @ features_F
        towards_P_C = (self._covariance_P_P.reshape(-1, classes, width) @ features_F).reshape(-1, classes)
        prior_C_C = np.einsum("cfd,f->cd", towards_P_C.reshape(classes, width, classes), features_F)
        logits_C, curvature_C_C = _settled(before_C, prior_C_C, label)
        # The sample's pull on its logits: the gradient of its log likelihood where they have settled.
        pull_C = np.eye(classes)[label] - softmax(logits_C)
        self._mean_C_F = self._mean_C_F + (towards_P_C @ pull_C).reshape(classes, width)
        gain_C_C = curvature_C_C @ np.linalg.inv(np.eye(classes) + prior_C_C @ curvature_C_C)
        self._covariance_P_P -= towards_P_C @ gain_C_C @ towards_P_C.T


def _settled(before_C: np.ndarray, prior_C_C: np.ndarray, label: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the most probable logits of a sample of that class under N(before, prior), and their curvature (C, C)."""
    wanted_C = np.eye(len(before_C))[label]
    logits_C = before_C
    for _ in range(NEWTON_STEPS):
        p_C = softmax(logits_C)
        curvature_C_C = np.diag(p_C) - np.outer(p_C, p_C)
        # Newton on -log p_label(f) + (f - before)ᵀ prior⁻¹ (f - before) / 2, multiplied by the prior.
        residual_C = logits_C - before_C - prior_C_C @ (wanted_C - p_C)
        step_C = np.linalg.solve(np.eye(len(p_C)) + prior_C_C @ curvature_C_C, residual_C)
        logits_C = logits_C - step_C
        if np.abs(step_C).max() < TOLERANCE:
            break
    p_C = softmax(logits_C)
    return logits_C, np.diag(p_C) - np.outer(p_C, p_C)


def _with_constant(x_N_D: np.ndarray) -> np.ndarray:
    return np.column_stack([x_N_D, np.ones(len(x_N_D))]).astype(float)


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
