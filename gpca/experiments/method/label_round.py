"""Repeats the first round of a run's active learning, which the figure of the pipeline draws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gpca.active_learning.acquisition import EXPANSION, select, top
from gpca.active_learning.rounds import Embedded, initial_gpc, make_task, pool_of
from gpca.active_learning.settings import ActiveLearningSettings
from gpca.experiments.method.shown_sample import Stages
from gpca.seeds import generator

STRATEGY = "bald_kmeans"  # the paper's
SETTING = "pretrained"  # The encoder knows all concepts, and the classifier all but one.


@dataclass(frozen=True)
class Round:
    """Holds the first round of labels, with the pool's N training samples.

    Attributes:
        rows_N: The rows of the pool.
        labeled: The rows of the samples that were labeled at the start, none of the new concept.
        map_S_2: The principal components of all embeddings, fitted to the standardized ones of the training samples.
        bald_N: BALD of the pool in nats, by the classifier that knows all concepts but the new one.
        candidates, chosen: The places in `rows_N` of the B·K largest BALD, and of the B of them that k-means keeps.
    """

    rows_N: np.ndarray
    labeled: np.ndarray
    map_S_2: np.ndarray
    bald_N: np.ndarray
    candidates: np.ndarray
    chosen: np.ndarray


def first_round(stages: Stages, held_out: str, settings: ActiveLearningSettings, source: str, seed: int) -> Round:
    """Fit the classifier that does not know a concept yet, and let the paper's strategy choose from the pool.

    Start, pool and classifier are those of the run's learning curves with this source and seed.

    Raises:
        InputError: see :func:`gpca.active_learning.rounds.make_task`.
    """
    from sklearn.decomposition import PCA
    from sklearn.preprocessing import StandardScaler

    of = stages.registrations
    row_S_1 = np.arange(len(of))[:, None]
    of_rows, task = (
        make_task(Embedded(each, of.concept, of.split), held_out, settings, source, seed)
        for each in (row_S_1, stages.h_S_d)
    )
    gpc = initial_gpc(task, settings, source, seed, SETTING)
    rows_N, labeled = of_rows.pool.h[:, 0], of_rows.initial.h[:, 0]
    pool = pool_of(task.project(gpc), gpc, np.arange(len(rows_N)), [])
    random = generator(source, seed, SETTING, "active_learning", held_out, STRATEGY)
    chosen = select(STRATEGY, pool, settings.batch, random)
    train = of.rows("train")
    scaler = StandardScaler().fit(stages.h_S_d[train])
    h_S_d = scaler.transform(stages.h_S_d)
    map_S_2 = PCA(2, svd_solver="full").fit(h_S_d[train]).transform(h_S_d)
    return Round(rows_N, labeled, map_S_2, pool.bald_N, top(pool.bald_N, settings.batch * EXPANSION), chosen)
