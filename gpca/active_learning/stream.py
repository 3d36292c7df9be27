"""Active learning on a stream: samples arrive one at a time, and the learner asks for some of the labels."""

import math
from copy import copy
from itertools import combinations_with_replacement

import numpy as np
from scipy.special import softmax

from gpca.active_learning.rounds import LabelingTask, Samples, step_of
from gpca.active_learning.settings import ActiveLearningSettings, StreamSettings
from gpca.classifier.gpc import GPC
from gpca.classifier.latents import Projection
from gpca.classifier.scores import summarize_draws
from gpca.errors import InputError
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator

DEVIATION = 3.0  # of a logit by the prior, chosen on development seed 100 of YCB
DRAWS = 30  # of the weights, as in CLEVER
NEWTON_STEPS = 20
TOLERANCE = 1e-10  # of a logit


class BayesianLayer:
    """Softmax regression on the frozen encoder, after CLEVER (Lee et al. 2025); asks by the lack of confidence.

    The Gaussian posterior over the weights (C, F) after a label is the prior of the next: Laplace's approximation with
    generalized Gauss-Newton curvature (Daxberger et al. 2021), in the C dimensions of the sample's logits (extended
    Kalman filter). A constant joins the F - 1 features; where they have unit variance, `DEVIATION` is a logit's by the
    prior. One linear layer stands in place of CLEVER's progressive columns, the budget manager in that of thresholds.
    """

    classes = CONCEPTS

    def __init__(self, initial: Samples, *axes: object) -> None:
        shape = (len(CONCEPTS), initial.h.inputs_N_d.shape[1] + 1)
        self._mean_C_F, self._covariance_P_P = np.zeros(shape), np.eye(math.prod(shape)) * (DEVIATION**2 / shape[1])
        self._normal_M_C = generator(*axes, "layer").normal(size=(DRAWS, len(CONCEPTS)))
        self.update(initial.h, initial.concept_N)

    def update(self, h: Projection, labels: np.ndarray, *_passes: float) -> None:
        """Learn samples and their concepts in order."""
        classes, width = self._mean_C_F.shape
        for features_F, concept in zip(_with_constant(h.inputs_N_d), labels, strict=True):
            label = CONCEPTS.index(concept)
            before_C = self._mean_C_F @ features_F
            towards_P_C = (self._covariance_P_P.reshape(-1, classes, width) @ features_F).reshape(-1, classes)
            prior_C_C = np.einsum("cfd,f->cd", towards_P_C.reshape(classes, width, classes), features_F)
            logits_C, curvature_C_C = _settled(before_C, prior_C_C, label)
            # Gradient of the log likelihood at the new logits.
            gradient_C = np.eye(classes)[label] - softmax(logits_C)
            self._mean_C_F = self._mean_C_F + (towards_P_C @ gradient_C).reshape(classes, width)
            gain_C_C = curvature_C_C @ np.linalg.inv(np.eye(classes) + prior_C_C @ curvature_C_C)
            self._covariance_P_P -= towards_P_C @ gain_C_C @ towards_P_C.T

    def logits(self, h: Projection) -> tuple[np.ndarray, np.ndarray]:
        """Return mean (N, C) and covariance (N, C, C) of the logits."""
        features_N_F = _with_constant(h.inputs_N_d)
        classes, width = self._mean_C_F.shape
        spread_C_F_C_F = self._covariance_P_P.reshape(classes, width, classes, width)
        covariance_N_C_C = np.empty((len(features_N_F), classes, classes))
        for c, d in combinations_with_replacement(range(classes), 2):
            half_N_F = features_N_F @ spread_C_F_C_F[c, :, d]
            covariance_N_C_C[:, c, d] = covariance_N_C_C[:, d, c] = np.einsum("nf,nf->n", half_N_F, features_N_F)
        return features_N_F @ self._mean_C_F.T, covariance_N_C_C

    def attribute(self, h: Projection) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return scores and variances by draws of the logits, and utilities of labels (N,)."""
        mean_N_C, covariance_N_C_C = self.logits(h)
        root_N_C_C = np.linalg.cholesky(covariance_N_C_C + 1e-9 * np.eye(covariance_N_C_C.shape[1]))
        drawn_M_N_C = mean_N_C + np.einsum("ncd,md->mnc", root_N_C_C, self._normal_M_C)
        scores_N_C, variances_N_C, _ = summarize_draws(drawn_M_N_C)
        return scores_N_C, variances_N_C, 1 - scores_N_C.max(axis=1)


def _settled(before_C: np.ndarray, prior_C_C: np.ndarray, label: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the most probable logits of a sample of this class under N(before, prior), and their curvature (C, C)."""
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


def arrival_order(task: LabelingTask, stream: StreamSettings, *axes: object) -> np.ndarray:
    """Rows of the pool in order of arrival: without the new concept while `quiet`, then in equal parts."""
    random = generator(*axes, "stream", task.held_out)
    order = random.permutation(len(task.pool))
    is_new = task.pool.concept_N[order] == task.held_out
    new, others = order[is_new], order[~is_new]
    n_new = round((stream.arrivals - stream.quiet) / len(np.unique(task.pool.concept_N)))
    if n_new > len(new) or stream.arrivals - n_new > len(others) or n_new < 1:
        fault = f"needs a larger pool than {len(others)} known and {len(new)} new samples"
        raise InputError(f"a stream of {stream.arrivals} arrivals", fault, "lower active_learning.stream.arrivals")
    rest = others[stream.quiet : stream.arrivals - n_new]
    return np.concatenate([others[: stream.quiet], random.permutation(np.concatenate([new[:n_new], rest]))])


def run_stream(
    task: LabelingTask[Projection],
    gpc: GPC,
    strategy: str,
    settings: ActiveLearningSettings,
    stream: StreamSettings,
    *axes: object,
) -> list[dict[str, float]]:
    """Run a stream; labels are learned at once, by a copy of `gpc`, which has projected the task, or another learner.

    ``stream_bald`` asks if BALD exceeds a quantile of the last `window` arrivals, adjusted to the budget (Balanced
    Incremental Quantile Filter, Kottke et al. 2015); ``stream_clever`` so by its own uncertainty. A row per `every`
    arrivals has ``arrived``; ``present``, whether the quiet time is over; ``running`` accuracy over the last `window`
    arrivals, each judged before its label; and a step of rounds.
    """
    from skactiveml.stream import StreamRandomSampling
    from skactiveml.stream.budgetmanager import BalancedIncrementalQuantileFilter

    random = generator(*axes, "stream", task.held_out, strategy)
    is_layer = strategy == "stream_clever"
    learner = BayesianLayer(task.initial, *axes, task.held_out) if is_layer else copy(gpc)
    if strategy == "stream_random":
        seed = int(random.integers(2**31))
        sampling = StreamRandomSampling(budget=stream.budget, allow_exceeding_budget=False, random_state=seed)
    else:
        quantile = BalancedIncrementalQuantileFilter(w=stream.window, w_tol=stream.window, budget=stream.budget)
    right: list[bool] = []
    queried: list[int] = []

    def row() -> dict[str, float]:
        running = float(np.mean(right[-stream.window :])) if right else float("nan")
        present = int(len(right) >= stream.quiet)
        step = step_of(task, learner, queried, epochs=0)
        return {"arrived": len(right), "present": present, "running": running, **step}

    rows = [row()]
    for arrived in arrival_order(task, stream, *axes):
        h = task.pool.h[[arrived]]
        scores_1_C, _, worth_1 = learner.attribute(h)
        right.append(learner.classes[int(scores_1_C.argmax())] == task.pool.concept_N[arrived])
        if strategy == "stream_random":
            asked = sampling.query(worth_1[:, None])
            sampling.update(worth_1[:, None], asked)
        else:
            asked = quantile.query_by_utility(worth_1)
            quantile.update(worth_1[:, None], asked, worth_1)
        if len(asked):
            queried.append(arrived)
            learner.update(h, task.pool.concept_N[[arrived]], settings.iterations, settings.tolerance)
        if len(right) % stream.every == 0:
            rows.append(row())
    return rows
