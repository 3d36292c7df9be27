"""Active learning on a stream: samples arrive one at a time, and the learner asks for some of the labels.

The paper's loop (Sec. III-C and Fig. 4): the classifier names the concept of each sample; if its uncertainty exceeds a
threshold and the budget allows, it asks for the label and learns it. The learners of Narr et al. (2016) and CLEVER
(2025), which the paper cites, use the same embeddings, initial samples and budget.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from typing import Protocol

import numpy as np

from gpca.active_learning.rounds import LabelingTask, accuracies
from gpca.active_learning.settings import ActiveLearningSettings, StreamSettings
from gpca.active_learning.stream_models import BayesianLayer, MondrianForest
from gpca.attribution.scores import entropy
from gpca.classifier.gpc import GPC
from gpca.classifier.latents import Projection
from gpca.errors import InputError
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator

TREES = 10
DEVIATION = 3.0  # of a logit by the prior; it and the number of trees were chosen on development seed 100 of YCB
DRAWS = 30  # of the weights, as in CLEVER


class StreamLearner(Protocol):
    """The interface of stream learners, a part of the GPC's."""

    classes: tuple[str, ...]

    def attribute(self, h: Projection) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return scores (N, C), their variances (N, C), and the utility of a label for each sample (N,)."""

    def scores(self, h: Projection) -> np.ndarray:
        """Return the scores alone."""

    def update(self, h: Projection, labels: np.ndarray, iterations: int, tolerance: float) -> int:
        """Learn further labels."""


class MondrianLearner:
    """A Mondrian forest, as in Narr et al. (2016), without their additions to it; asks by the predictive entropy."""

    classes = CONCEPTS

    def __init__(self, task: LabelingTask[Projection], *axes: object) -> None:
        self._forest = MondrianForest(len(self.classes), generator(*axes, "mondrian"), TREES)
        self.update(task.initial.h, task.initial.concept_N)

    def attribute(self, h: Projection) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return scores, NaN as variances, and the entropy of the scores."""
        scores_N_C = self.scores(h)
        return scores_N_C, np.full(scores_N_C.shape, np.nan), entropy(scores_N_C)

    def scores(self, h: Projection) -> np.ndarray:
        """Return the scores."""
        return self._forest.scores(h.inputs_N_d)

    def update(self, h: Projection, labels: np.ndarray, *_passes: float) -> int:
        """Update every tree."""
        self._forest.learn(h.inputs_N_d, _numbers(labels))
        return 1


class LayerLearner:
    """A Bayesian layer on the frozen encoder, after CLEVER (Lee et al. 2025); asks by the lack of confidence.

    CLEVER's network has a Laplace approximation whose prior is its earlier posterior, and asks for a demonstration if
    it is not confident. Here, one linear layer replaces its progressive columns, the initial concepts the data of its
    prior, one label a demonstration, and the budget manager its thresholds.
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
        """Update the posterior."""
        self._layer.learn(h.inputs_N_d, _numbers(labels))
        return 1


def _numbers(labels: np.ndarray) -> np.ndarray:
    return np.array([CONCEPTS.index(label) for label in labels])


LEARNERS: dict[str, Callable[..., StreamLearner]] = {"stream_narr": MondrianLearner, "stream_clever": LayerLearner}


def arrival_order(task: LabelingTask, stream: StreamSettings, *axes: object) -> np.ndarray:
    """Return the rows of the pool in the order of arrival: without the new concept while `quiet`, then in equal parts.

    Raises:
        InputError: the pool is too small.
    """
    random = generator(*axes, "stream", task.held_out)
    order = random.permutation(len(task.pool))
    is_new = task.pool.concept_N[order] == task.held_out
    new, others = order[is_new], order[~is_new]
    mixed = stream.arrivals - stream.quiet
    n_new = round(mixed / len(np.unique(task.pool.concept_N)))
    if n_new > len(new) or stream.arrivals - n_new > len(others) or n_new < 1:
        raise InputError(
            f"a stream of {stream.arrivals} arrivals",
            f"needs a larger pool than {len(others)} known and {len(new)} new samples",
            "lower active_learning.stream.arrivals",
        )
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
    """Run a stream; labels are learned at once.

    ``stream_bald`` asks if BALD exceeds a quantile of the last `window` arrivals, adjusted to the budget (Balanced
    Incremental Quantile Filter, Kottke et al. 2015); ``stream_random`` asks at random. The others ask as
    ``stream_bald`` does, with learners and uncertainties of their own.

    Args:
        task: projected by `gpc`.
        gpc: result of :func:`gpca.active_learning.rounds.initial_gpc`; it is not changed.

    Returns:
        One row per `every` arrivals: ``arrived``; ``present``, whether the quiet time is over; ``labels``;
        ``new_labels`` of the new concept; ``running`` accuracy over the last `window` arrivals, each judged before its
        label; ``accuracy`` and ``accuracy_new`` on the test samples.
    """
    from skactiveml.stream import StreamRandomSampling
    from skactiveml.stream.budgetmanager import BalancedIncrementalQuantileFilter

    random = generator(*axes, "stream", task.held_out, strategy)
    if strategy == "stream_random":
        seed = int(random.integers(2**31))
        manager = StreamRandomSampling(budget=stream.budget, allow_exceeding_budget=False, random_state=seed)
    else:
        manager = BalancedIncrementalQuantileFilter(w=stream.window, w_tol=stream.window, budget=stream.budget)
    learner: StreamLearner = LEARNERS[strategy](task, *axes, task.held_out) if strategy in LEARNERS else copy(gpc)
    right: list[bool] = []
    queried: list[int] = []
    steps = [_row(task, learner, right, queried, stream)]
    for row in arrival_order(task, stream, *axes):
        h = task.pool.h[[row]]
        concept = task.pool.concept_N[row]
        scores_1_C, _, worth_1 = learner.attribute(h)
        right.append(learner.classes[int(scores_1_C.argmax())] == concept)
        if _asks(manager, worth_1):
            queried.append(row)
            learner.update(h, task.pool.concept_N[[row]], settings.iterations, settings.tolerance)
        if len(right) % stream.every == 0:
            steps.append(_row(task, learner, right, queried, stream))
    return steps


def _asks(manager, worth_1: np.ndarray) -> bool:
    if hasattr(manager, "query_by_utility"):
        queried = manager.query_by_utility(worth_1)
        manager.update(worth_1[:, None], queried, worth_1)
    else:
        queried = manager.query(worth_1[:, None])
        manager.update(worth_1[:, None], queried)
    return len(queried) > 0


def _row(
    task: LabelingTask[Projection],
    learner: StreamLearner,
    right: list[bool],
    queried: list[int],
    stream: StreamSettings,
) -> dict[str, float]:
    accuracy, accuracy_new = accuracies(task, learner)
    return {
        "arrived": len(right),
        "present": int(len(right) >= stream.quiet),
        "labels": len(queried),
        "new_labels": int(np.sum(task.pool.concept_N[queried] == task.held_out)) if queried else 0,
        "running": float(np.mean(right[-stream.window :])) if right else float("nan"),
        "accuracy": accuracy,
        "accuracy_new": accuracy_new,
    }
