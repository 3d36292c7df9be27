"""Table III under other readings of the classifier in active learning, the protocol's own among them.

The paper does not say whether a retraining starts anew, nor by which samples the inputs are scaled.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from gpca.active_learning.retraining import Retraining, Step, learn
from gpca.active_learning.rounds import LabelingTask
from gpca.active_learning.settings import RareSettings
from gpca.classifier.gpc import GPC
from gpca.experiments.specification_curve.labels import (
    NEW,
    RANDOM_BATCH,
    base_settings,
    judged_task,
    rare_settings,
    until,
)
from gpca.experiments.specification_curve.run_files import Row, RunFiles
from gpca.experiments.specification_curve.settings import Reading, ReadingSizes
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress

STRATEGIES = ("bald_kmeans", "random")


def run(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield labels and epochs to the target under each reading, by BALD with k-means and by random choice."""
    rare, target = rare_settings(run_files)
    for source, seed, _, registrations in run_files.in_distribution():
        task, axes = judged_task(run_files, registrations, source, seed)
        for reading in progress(readings, f"classifiers of {source}, seed {seed}"):
            gpc = replace(rare.gpc, learning_rate=reading["learning_rate"], iterations=reading["iterations"])
            sees_pool = reading["inputs"] == "pool"
            for strategy in STRATEGIES:
                if reading["start"] == "posterior":
                    of_reading = replace(rare, gpc=gpc)
                    steps = _by_the_posterior(run_files, task, strategy, of_reading, sees_pool, target, *axes)
                else:
                    warm = reading["start"] == "warm"
                    retraining = Retraining(task, gpc, *axes, warm=warm, sees_pool=sees_pool)
                    steps = learn(retraining, strategy, rare, [target], *axes).steps
                at = next((step for step in steps if step["accuracy"] >= target), steps[-1])
                values = {"labels_to_target": at["labels"], "reached": at["accuracy"] >= target}
                if reading["start"] != "posterior":  # whose passes are no epochs of Adam
                    values["epochs_at_target"] = at["epochs"]
                for metric, value in values.items():
                    yield reading, source, strategy, metric, NEW, seed, float(value)


def _by_the_posterior(
    run_files: RunFiles,
    task: LabelingTask[np.ndarray],
    strategy: str,
    rare: RareSettings,
    sees_pool: bool,
    target: float,
    *axes: object,
) -> list[Step]:
    """Return the rounds to the target in which further labels move the first classifier's posterior alone."""
    around = np.concatenate([task.initial.h, task.pool.h]) if sees_pool else None
    gpc = GPC(CONCEPTS, rare.gpc, *axes, "posterior").fit(task.initial.h, task.initial.concept_N, around)
    gpc.level()
    base, _ = base_settings(run_files)
    batch = RANDOM_BATCH if strategy == "random" else rare.batch
    return until(target, task, gpc, strategy, replace(base, batch=batch, labels=rare.labels), *axes)[0]
