"""Table III under other readings of the classifier in active learning: the paper's own among them.

The paper trains with a rate of 0.01 for 100 iterations, and does not say whether a retraining starts anew, nor by which
samples the inputs are scaled.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from gpca.active_learning.acquisition import require_strategy, select
from gpca.active_learning.rounds import LabelingTask, make_task, pool_of, rounds, step_of
from gpca.active_learning.settings import ActiveLearningSettings
from gpca.classifier.gpc import GPC
from gpca.experiments.specification_curve.labels import NEW, RANDOM_BATCH, base_settings
from gpca.experiments.specification_curve.run_files import Row, RunFiles
from gpca.experiments.specification_curve.settings import Reading, ReadingSizes
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.seeds import generator

Step = dict[str, float]


def run(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the labels to the target under each reading, by BALD with k-means and by random choice."""
    base, target = base_settings(run_files)
    for source, seed, _, registrations in run_files.in_distribution():
        task = make_task(registrations, NEW, base, source, seed)
        # BALD has the protocol's budget, several times what the paper prints; random choice has the whole pool.
        budgets = {"bald_kmeans": (base.batch, base.labels), "random": (RANDOM_BATCH, len(task.pool))}
        for reading in progress(readings, f"classifiers of {source}, seed {seed}"):
            gpc = replace(base.gpc, learning_rate=reading["learning_rate"], iterations=reading["iterations"])
            steps_of = {"warm": warm, "cold": cold}[reading["start"]]
            for strategy, (batch, labels) in budgets.items():
                settings = replace(base, gpc=gpc, batch=batch, labels=labels)
                for step in steps_of(task, strategy, settings, reading["inputs"] == "pool", source, seed):
                    if step["accuracy"] >= target:
                        break
                yield reading, source, strategy, "labels_to_target", NEW, seed, float(step["labels"])
                yield reading, source, strategy, "reached", NEW, seed, float(step["accuracy"] >= target)


def warm(
    task: LabelingTask[np.ndarray], strategy: str, settings: ActiveLearningSettings, sees_pool: bool, *axes: object
) -> Iterator[Step]:
    """Yield the rounds in which further labels move the first classifier's posterior, as in the protocol.

    Args:
        task, strategy, settings: as for :func:`gpca.active_learning.rounds.rounds`.
        sees_pool: whether inputs are scaled, and inducing inputs and lengthscale start, by the pool too, or by the
            labeled samples alone.
        axes: the names of the draws.
    """
    gpc = _fitted(task, [], settings, sees_pool, *axes)
    gpc.level()
    for step, _ in rounds(task.project(gpc), gpc, strategy, settings, *axes, "reading"):
        yield step


def cold(
    task: LabelingTask[np.ndarray], strategy: str, settings: ActiveLearningSettings, sees_pool: bool, *axes: object
) -> Iterator[Step]:
    """Yield the rounds in which a new classifier learns from all labels each time; arguments as of :func:`warm`."""
    random = generator(*axes, "reading", "cold", strategy)
    queried: list[int] = []
    while True:
        gpc = _fitted(task, queried, settings, sees_pool, *axes)
        projected = task.project(gpc)
        yield step_of(projected, gpc, queried, epochs=settings.gpc.iterations)
        left = np.setdiff1d(np.arange(len(task.pool)), queried)
        most = min(settings.batch, settings.labels - len(queried), len(left))
        if most <= 0:
            return
        pool = pool_of(projected, gpc, left, queried, require_strategy(strategy).needs_scores)
        queried += left[select(strategy, pool, most, random)].tolist()


def _fitted(
    task: LabelingTask[np.ndarray], queried: list[int], settings: ActiveLearningSettings, sees_pool: bool, *axes: object
) -> GPC:
    labeled_L_d = np.concatenate([task.initial.h, task.pool.h[queried]])
    concept_L = np.concatenate([task.initial.concept_N, task.pool.concept_N[queried]])
    around = np.concatenate([task.initial.h, task.pool.h]) if sees_pool else None
    return GPC(CONCEPTS, settings.gpc, *axes, "reading", NEW).fit(labeled_L_d, concept_L, around)
