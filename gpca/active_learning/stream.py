"""Active learning on a stream: samples arrive one at a time, and the learner asks for some of the labels.

The paper's loop (Sec. III-C and Fig. 4): the classifier names the concept of each sample; if its uncertainty exceeds a
threshold and the budget allows, it asks for the label and learns it. The learners of Narr et al. (2016) and CLEVER
(2025), which the paper cites, use the same embeddings, initial samples and budget.
"""

from collections.abc import Callable
from copy import copy

import numpy as np

from gpca.active_learning.rounds import LabelingTask, step_of
from gpca.active_learning.settings import ActiveLearningSettings, StreamSettings
from gpca.active_learning.stream_models import BayesianLayer, MondrianForest
from gpca.classifier.gpc import GPC
from gpca.classifier.latents import Projection
from gpca.classifier.scores import entropy
from gpca.errors import InputError
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator

TREES = 10
DEVIATION = 3.0  # of a logit by the prior; it and the number of trees were chosen on development seed 100 of YCB
DRAWS = 30  # of the weights, as in CLEVER
Attribute = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]


class StreamLearner:
    """A model in the place of the GPC: the initial samples are learned at once, and labels as they come.

    It learns samples (N, d) and their numbers of concepts (N,), and attributes scores and variances (N, C), and the
    utility of a label for each sample (N,).
    """

    classes = CONCEPTS

    def __init__(self, learn: Callable[..., None], attribute: Attribute, task: LabelingTask[Projection]) -> None:
        self._learn, self._attribute = learn, attribute
        self.update(task.initial.h, task.initial.concept_N)

    def attribute(self, h: Projection) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return scores, variances and utilities."""
        return self._attribute(h.inputs_N_d)

    def scores(self, h: Projection) -> np.ndarray:
        """Return the scores alone."""
        return self.attribute(h)[0]

    def update(self, h: Projection, labels: np.ndarray, *_passes: float) -> int:
        """Learn further labels."""
        self._learn(h.inputs_N_d, np.array([CONCEPTS.index(label) for label in labels]))
        return 1


def mondrian_learner(task: LabelingTask[Projection], *axes: object) -> StreamLearner:
    """A Mondrian forest, as in Narr et al. (2016), without their additions to it; asks by the predictive entropy."""
    forest = MondrianForest(len(CONCEPTS), generator(*axes, "mondrian"), TREES)

    def attribute(x_N_D: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        scores_N_C = forest.scores(x_N_D)
        return scores_N_C, np.full(scores_N_C.shape, np.nan), entropy(scores_N_C)

    return StreamLearner(forest.learn, attribute, task)


def layer_learner(task: LabelingTask[Projection], *axes: object) -> StreamLearner:
    """A Bayesian layer on the frozen encoder, after CLEVER (Lee et al. 2025); asks by the lack of confidence.

    In place of CLEVER's progressive columns stands one linear layer, of the data of its prior the initial concepts, of
    a demonstration one label, and of its thresholds the budget manager.
    """
    layer = BayesianLayer(task.initial.h.inputs_N_d.shape[1], len(CONCEPTS), DEVIATION)
    normal_M_C = generator(*axes, "layer").normal(size=(DRAWS, len(CONCEPTS)))

    def attribute(x_N_D: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        scores_N_C, variances_N_C, _ = layer.attribute(x_N_D, normal_M_C)
        return scores_N_C, variances_N_C, 1 - scores_N_C.max(axis=1)

    return StreamLearner(layer.learn, attribute, task)


LEARNERS: dict[str, Callable[..., StreamLearner]] = {"stream_narr": mondrian_learner, "stream_clever": layer_learner}


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
    Incremental Quantile Filter, Kottke et al. 2015); ``stream_random`` asks at random. The others ask as
    ``stream_bald`` does, with learners and uncertainties of their own.

    A row per `every` arrivals has ``arrived``; ``present``, whether the quiet time is over; ``running`` accuracy over
    the last `window` arrivals, each judged before its label; and a step of :func:`gpca.active_learning.rounds.rounds`.
    """
    from skactiveml.stream import StreamRandomSampling
    from skactiveml.stream.budgetmanager import BalancedIncrementalQuantileFilter

    random = generator(*axes, "stream", task.held_out, strategy)
    learner = LEARNERS[strategy](task, *axes, task.held_out) if strategy in LEARNERS else copy(gpc)
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
