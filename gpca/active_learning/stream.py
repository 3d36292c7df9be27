"""The online form of active learning: samples arrive one at a time, and labels are requested where they pay off.

The paper's loop (Sec. III-C and Fig. 4): the classifier names a concept as a sample arrives; where its uncertainty
passes a threshold, and the budget allows, it asks for the label and learns. The learners of Narr et al. (2016) and
CLEVER (2025), which the paper cites for it, meet the same stream (:mod:`gpca.active_learning.stream_learners`).
"""

from __future__ import annotations

from copy import copy

import numpy as np

from gpca.active_learning.rounds import LabelingTask, accuracies
from gpca.active_learning.settings import ActiveLearningSettings, StreamSettings
from gpca.active_learning.stream_learners import LEARNERS, StreamLearner
from gpca.classifier.gpc import GPC
from gpca.classifier.latents import Projection
from gpca.errors import InputError
from gpca.seeds import generator


def arrival_order(task: LabelingTask, stream: StreamSettings, *axes: object) -> np.ndarray:
    """Return the rows of the pool in the order of arrival: known concepts alone while `quiet`, then all in equal parts.

    Raises:
        InputError: the pool is too small for such a stream.
    """
    random = generator(*axes, "stream", task.held_out)
    order = random.permutation(len(task.pool))
    is_new = task.pool.concept_N[order] == task.held_out
    new, known = order[is_new], order[~is_new]
    mixed = stream.arrivals - stream.quiet
    n_new = round(mixed / len(np.unique(task.pool.concept_N)))
    if n_new > len(new) or stream.arrivals - n_new > len(known) or n_new < 1:
        raise InputError(
            f"a stream of {stream.arrivals} arrivals",
            f"needs a larger pool than {len(known)} known and {len(new)} new samples",
            "lower active_learning.stream.arrivals",
        )
    rest = known[stream.quiet : stream.arrivals - n_new]
    return np.concatenate([known[: stream.quiet], random.permutation(np.concatenate([new[:n_new], rest]))])


def run_stream(
    task: LabelingTask[Projection],
    gpc: GPC,
    strategy: str,
    settings: ActiveLearningSettings,
    stream: StreamSettings,
    *axes: object,
) -> list[dict[str, float]]:
    """Let the samples arrive, ask about some, learn at once.

    ``stream_bald`` asks where BALD exceeds a quantile of the last `window` arrivals, raised or lowered to stay within
    the budget (Balanced Incremental Quantile Filter, Kottke et al. 2015); ``stream_random`` asks at random. The others
    ask as ``stream_bald``, by an uncertainty of their own, and learn in the GPC's place.

    Args:
        task: projected by `gpc`.
        gpc: what :func:`gpca.active_learning.rounds.initial_gpc` returns; it is not changed.

    Returns:
        every so many arrivals: ``arrived``; ``present``, whether the quiet time is over; ``labels``
        asked for, ``new_labels`` of the new concept; ``running`` accuracy over the last `window` arrivals, each judged
        before its label is known; ``accuracy`` and ``accuracy_new`` on the test samples.
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
