"""Learning a new concept from few labels (paper Sec. III-C and IV-C)."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from gpca.active_learning.acquisition import Pool, require_strategy, select
from gpca.active_learning.settings import ActiveLearningSettings
from gpca.classifier.gpc import GPC
from gpca.classifier.latents import Projection
from gpca.errors import InputError
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator

Inputs = TypeVar("Inputs", np.ndarray, Projection)


@dataclass(frozen=True)
class Samples(Generic[Inputs]):
    """N embeddings (N, d), or their :class:`Projection`, and their concepts (N,)."""

    h: Inputs
    concept_N: np.ndarray

    def __len__(self) -> int:
        return len(self.concept_N)


@dataclass(frozen=True)
class LabelingTask(Generic[Inputs]):
    """A held-out concept, initial labeled samples of the others, pool and test samples."""

    held_out: str
    initial: Samples
    pool: Samples
    test: Samples

    def project(self, gpc: GPC) -> LabelingTask[Projection]:
        """Project every embedding to the inputs of the GPC's covariance."""
        parts = (Samples(gpc.project(part.h), part.concept_N) for part in (self.initial, self.pool, self.test))
        return LabelingTask(self.held_out, *parts)

    def labeled(self: LabelingTask[np.ndarray], rows: list[int] | slice = slice(None)) -> tuple[np.ndarray, np.ndarray]:
        """Return embeddings and concepts of the initial samples and of rows of the pool, by default all."""
        initial, pool = self.initial, self.pool
        concept_L = np.concatenate([initial.concept_N, pool.concept_N[rows]])
        return np.concatenate([initial.h, pool.h[rows]]), concept_L


def make_task(
    samples: Registrations,
    held_out: str,
    settings: ActiveLearningSettings,
    *axes: object,
    new_share: float | None = None,
) -> LabelingTask[np.ndarray]:
    """Split the training samples into initial ones, equally many of each other concept, and the pool of the rest."""
    train = generator(*axes, "initial", held_out).permutation(samples.rows("train"))
    concept_S = samples.concept
    others = [concept for concept in CONCEPTS if concept != held_out]
    each = settings.initial // len(others)
    initial = np.concatenate([train[concept_S[train] == concept][:each] for concept in others])
    pool = np.setdiff1d(train, initial)
    new = pool[concept_S[pool] == held_out]
    if new_share is not None:
        kept = round((len(pool) - len(new)) * new_share / (1 - new_share))
        new_kept = generator(*axes, "rare", held_out).permutation(new)[:kept]
        pool, new = np.setdiff1d(pool, np.setdiff1d(new, new_kept)), new_kept
    if len(initial) < each * len(others) or len(pool) == len(new) or not len(new):
        raise InputError(
            f"active learning with {settings.initial} labeled samples of {' and '.join(others)}",
            f"leaves none of {len(train)} training samples for the pool",
            "lower active_learning.initial or raise registrations.train",
        )
    rows = (initial, pool, samples.rows("test"))
    return LabelingTask(held_out, *(Samples(samples.embedding[part], concept_S[part]) for part in rows))


def initial_gpc(task: LabelingTask[np.ndarray], settings: ActiveLearningSettings, *axes: object) -> GPC:
    """Fit the GPC on the initial labels, with scaling, inducing inputs and lengthscale initialized on the pool too."""
    gpc = GPC(CONCEPTS, settings.gpc, *axes, "active_learning", task.held_out)
    gpc.fit(task.initial.h, task.initial.concept_N, task.labeled()[0])
    gpc.level()
    return gpc


def rounds(
    task: LabelingTask[Projection], gpc: GPC, strategy: str, settings: ActiveLearningSettings, *axes: object
) -> Iterator[tuple[dict[str, float], list[int]]]:
    """Yield a step per round, the first before any label, and the rows of the pool labeled so far.

    A step has ``labels``, ``new_labels`` of the held-out concept, ``accuracy`` on all test samples, ``accuracy_new`` on
    those of the held-out concept, and ``epochs`` of the retraining. The `gpc`, which projected the task, is kept.
    """
    random = generator(*axes, "active_learning", task.held_out, strategy)
    gpc, needs_scores = copy(gpc), require_strategy(strategy).needs_scores
    left = np.arange(len(task.pool))
    queried: list[int] = []
    yield step_of(task, gpc, queried, epochs=0), []
    while len(queried) < settings.labels and len(left):
        pool = pool_of(task, gpc, left, queried, needs_scores)
        chosen = left[select(strategy, pool, min(settings.batch, settings.labels - len(queried)), random)]
        epochs = gpc.update(task.pool.h[chosen], task.pool.concept_N[chosen], settings.iterations, settings.tolerance)
        queried += chosen.tolist()
        left = np.setdiff1d(left, chosen)
        yield step_of(task, gpc, queried, epochs), list(queried)


def pool_of(
    task: LabelingTask[Projection], gpc: GPC, left: np.ndarray, queried: list[int], needs_scores: bool = True
) -> Pool:
    """Return the rows `left` of the pool with the GPC's scores and BALD, as a strategy reads them."""
    h = task.pool.h[left]
    scores_N_C, bald_N = np.empty((len(left), 0)), np.empty(len(left))
    if needs_scores:
        scores_N_C, _, bald_N = gpc.attribute(h)
    labeled = np.concatenate([task.initial.h.inputs_N_d, task.pool.h.inputs_N_d[queried]])
    return Pool(h.inputs_N_d, scores_N_C, bald_N, labeled, task.pool.concept_N[left])


def step_of(task: LabelingTask, classifier: Any, queried: list[int], epochs: int) -> dict[str, float]:
    """Return a step of :func:`rounds`; an accuracy without test samples is NaN."""
    named_N = np.array(classifier.classes)[classifier.attribute(task.test.h)[0].argmax(axis=1)]
    right_N = named_N == task.test.concept_N
    new_N = task.test.concept_N == task.held_out
    return {
        "labels": len(queried),
        "new_labels": int((task.pool.concept_N[queried] == task.held_out).sum()) if queried else 0,
        "accuracy": float(right_N.mean()),
        "accuracy_new": float(right_N[new_N].mean()) if new_N.any() else float("nan"),
        "epochs": epochs,
    }
