"""The seconds of one round of active learning: the choice of what is labeled, and the retraining by it."""

from __future__ import annotations

from copy import copy

import numpy as np

from gpca.active_learning.acquisition import select
from gpca.active_learning.rounds import Task, pool_of
from gpca.active_learning.settings import ActiveLearningSettings
from gpca.classifier.gpc import GPC
from gpca.classifier.latents import Projection
from gpca.model.stage_times import Times, timed

STRATEGY = "bald_kmeans"  # the paper's


def time_labelling(
    task: Task[Projection], gpc: GPC, settings: ActiveLearningSettings, random: np.random.Generator
) -> Times:
    """Measure BALD selection from the whole pool, and the update of a copy of the classifier.

    Args:
        task: projected by `gpc`.
    """
    left = np.arange(len(task.pool))
    chosen, elapsed = timed(lambda: select(STRATEGY, pool_of(task, gpc, left, []), settings.batch, random))
    yield ("bald", "CPU"), elapsed
    more = task.pool.h[chosen]
    labels = task.pool.concept_N[chosen]
    known = copy(gpc)
    yield ("retraining", "CPU"), timed(lambda: known.update(more, labels, settings.iterations, settings.tolerance))[1]
