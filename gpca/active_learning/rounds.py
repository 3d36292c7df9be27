"""Learning a concept that the classifier has never seen from few labels (paper Sec. III-C and IV-C).

A GPC that knows two concepts meets a pool with all three. In rounds, a strategy picks B samples, their labels join the
labeled ones and the GPC is retrained; its accuracy on the test samples over the labels spent is the learning curve.
"""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from gpca.active_learning.acquisition import Pool, require_strategy, select
from gpca.active_learning.settings import ActiveLearningSettings
from gpca.classifier.gpc import GPC
from gpca.classifier.latents import Projection
from gpca.errors import InputError
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator


@dataclass(frozen=True)
class Embedded:
    """S samples.

    Attributes:
        embedding: (S, d).
        concept, split: (S,) label, and ``train`` or ``test``.
    """

    embedding: np.ndarray
    concept: np.ndarray
    split: np.ndarray

    def rows(self, split: str) -> np.ndarray:
        """Return the row numbers of a split."""
        return np.flatnonzero(self.split == split)

    def followed_by(self, other: Embedded) -> Embedded:
        """Return these samples and those of the other after them."""
        return Embedded(
            np.concatenate([self.embedding, other.embedding]),
            np.concatenate([self.concept, other.concept]),
            np.concatenate([self.split, other.split]),
        )


Inputs = TypeVar("Inputs", np.ndarray, Projection)


@dataclass(frozen=True)
class Samples(Generic[Inputs]):
    """N embeddings (N, d), later their :class:`Projection`, and their concepts (N,)."""

    h: Inputs
    concept_N: np.ndarray

    def __len__(self) -> int:
        return len(self.concept_N)


@dataclass(frozen=True)
class LabelingTask(Generic[Inputs]):
    """The start of one experiment: the concept held out, labeled samples of the others, pool and test samples."""

    held_out: str
    initial: Samples
    pool: Samples
    test: Samples

    def project(self, gpc: GPC) -> LabelingTask[Projection]:
        """Return the task with every embedding as the GPC's covariance sees it."""
        parts = (Samples(gpc.project(part.h), part.concept_N) for part in (self.initial, self.pool, self.test))
        return LabelingTask(self.held_out, *parts)


def make_task(
    samples: Registrations | Embedded,
    held_out: str,
    settings: ActiveLearningSettings,
    *axes: object,
    classes: tuple[str, ...] = CONCEPTS,
    new_share: float | None = None,
) -> LabelingTask[np.ndarray]:
    """Split the training samples into those labeled at the start and the pool, which holds all the rest.

    Args:
        samples: they carry their embeddings.
        held_out: the concept of which no sample is labeled at the start.
        axes: names of the draw (source, seed).
        classes: all concepts; the start has equally many samples of each known one.
        new_share: share, below 1, of the pool that is of that concept, or as much of it as there is; by default all of
            its training samples are in the pool.

    Raises:
        InputError: too few training samples.
    """
    train = generator(*axes, "initial", held_out).permutation(samples.rows("train"))
    concept_S = samples.concept
    known = [concept for concept in classes if concept != held_out]
    each = settings.initial // len(known)
    initial = np.concatenate([train[concept_S[train] == concept][:each] for concept in known])
    pool = np.setdiff1d(train, initial)
    new = pool[concept_S[pool] == held_out]
    if new_share is not None:
        kept = round((len(pool) - len(new)) * new_share / (1 - new_share))
        new_kept = generator(*axes, "rare", held_out).permutation(new)[:kept]
        pool, new = np.setdiff1d(pool, np.setdiff1d(new, new_kept)), new_kept
    if len(initial) < each * len(known) or len(pool) == len(new) or not len(new):
        raise InputError(
            f"active learning with {settings.initial} labeled samples of {' and '.join(known)}",
            f"leaves none of {len(train)} training samples for the pool",
            f"lower active_learning.initial or raise {'registrations' if classes == CONCEPTS else 'causes'}.train",
        )
    rows = (initial, pool, samples.rows("test"))
    return LabelingTask(held_out, *(Samples(samples.embedding[part], concept_S[part]) for part in rows))


def initial_gpc(
    task: LabelingTask[np.ndarray], settings: ActiveLearningSettings, *axes: object, classes: tuple[str, ...] = CONCEPTS
) -> GPC:
    """Fit the GPC that knows all of its concepts but one.

    Scaling, inducing inputs and lengthscale are initialized on the unlabeled pool too: it lies open, and inducing
    inputs at the labeled samples alone would leave none where the new concept is.
    """
    gpc = GPC(classes, settings.gpc, *axes, "active_learning", task.held_out)
    around = np.concatenate([task.initial.h, task.pool.h])
    gpc.fit(task.initial.h, task.initial.concept_N, around)
    gpc.level()
    return gpc


def run_rounds(
    task: LabelingTask[Projection],
    gpc: GPC,
    strategy: str,
    settings: ActiveLearningSettings,
    *axes: object,
    answers_N: np.ndarray | None = None,
) -> list[dict[str, float]]:
    """Spend the budget by one strategy.

    Args:
        task: projected by `gpc`.
        gpc: what :func:`initial_gpc` returns; it is not changed.
        axes: the names of the draws (source, seed, …).
        answers_N: the oracle's answer for each sample of the pool; the truth by default.

    Returns:
        a step per round, the first before any label: ``labels`` spent, ``new_labels`` of the concept held out,
        ``accuracy`` on all test samples, ``accuracy_new`` on those of the concept held out, and ``epochs`` of the
        retraining.
    """
    return [step for step, _ in rounds(task, gpc, strategy, settings, *axes, answers_N=answers_N)]


def rounds(
    task: LabelingTask[Projection],
    gpc: GPC,
    strategy: str,
    settings: ActiveLearningSettings,
    *axes: object,
    answers_N: np.ndarray | None = None,
) -> Iterator[tuple[dict[str, float], list[int]]]:
    """Yield each step of :func:`run_rounds` as it is made, and the rows of the pool that were labeled so far."""
    random = generator(*axes, "active_learning", task.held_out, strategy)
    gpc = copy(gpc)
    answers_N = task.pool.concept_N if answers_N is None else answers_N
    left = np.arange(len(task.pool))
    queried: list[int] = []
    yield step_of(task, gpc, queried, epochs=0), []
    while len(queried) < settings.labels and len(left):
        pool = pool_of(task, gpc, left, queried, require_strategy(strategy).needs_scores)
        chosen = left[select(strategy, pool, min(settings.batch, settings.labels - len(queried)), random)]
        epochs = gpc.update(task.pool.h[chosen], answers_N[chosen], settings.iterations, settings.tolerance)
        queried += chosen.tolist()
        left = np.setdiff1d(left, chosen)
        yield step_of(task, gpc, queried, epochs), list(queried)


def pool_of(
    task: LabelingTask[Projection], gpc: GPC, left: np.ndarray, queried: list[int], needs_scores: bool = True
) -> Pool:
    """Return the pool of a strategy: the rows `left`, and the scores and BALD that the GPC gives them."""
    h = task.pool.h[left]
    if needs_scores:
        scores_N_C, _, bald_N = gpc.attribute(h)
    else:
        scores_N_C = np.empty((len(left), 0))
        bald_N = np.empty(len(left))
    labeled = np.concatenate([task.initial.h.inputs_N_d, task.pool.h.inputs_N_d[queried]])
    return Pool(h.inputs_N_d, scores_N_C, bald_N, labeled, task.pool.concept_N[left])


def step_of(task: LabelingTask, gpc: GPC, queried: list[int], epochs: int) -> dict[str, float]:
    """Return a step of :func:`run_rounds`, after the labels of these rows of the pool are known."""
    accuracy, accuracy_new = accuracies(task, gpc)
    return {
        "labels": len(queried),
        "new_labels": int(np.sum(task.pool.concept_N[queried] == task.held_out)) if queried else 0,
        "accuracy": accuracy,
        "accuracy_new": accuracy_new,
        "epochs": epochs,
    }


def accuracies(task: LabelingTask, classifier) -> tuple[float, float]:
    """Return the accuracy over all test samples and over those of the concept held out; NaN where there are none.

    The classifier is a GPC, or another object with its ``classes`` and ``scores``.
    """
    scores_N_C = classifier.scores(task.test.h)
    right_N = np.array(classifier.classes)[scores_N_C.argmax(axis=1)] == task.test.concept_N
    new_N = task.test.concept_N == task.held_out
    return float(right_N.mean()), float(right_N[new_N].mean()) if new_N.any() else float("nan")
