"""Lets the paper's strategy choose what a person would be asked about next, which the figure of the pipeline draws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gpca.active_learning.acquisition import EXPANSION, Pool, bald_kmeans, top
from gpca.errors import InputError
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures.shown_sample import Stages
from gpca.seeds import generator


@dataclass(frozen=True)
class Round:
    """Holds the next round of labels, with the N test samples as the pool.

    Attributes:
        rows_N: The rows of the test samples.
        map_S_2: The principal components of all embeddings, fitted to the standardised ones of the training samples.
        candidates, chosen: The places in `rows_N` of the B·K largest BALD, and of the B of them that k-means keeps.
    """

    rows_N: np.ndarray
    map_S_2: np.ndarray
    candidates: np.ndarray
    chosen: np.ndarray


def next_round(stages: Stages, batch: int) -> Round:
    """Let the paper's strategy choose what a person would be asked about next among the test samples."""
    from sklearn.decomposition import PCA
    from sklearn.preprocessing import StandardScaler

    train = stages.registrations.rows("train")
    rows_N = stages.registrations.rows("test")
    if not len(train):
        raise InputError("registrations", "hold no training samples", "raise registrations.train")
    scaler = StandardScaler().fit(stages.h_S_d[train])  # The classifier scales embeddings in the same way.
    h_S_d = scaler.transform(stages.h_S_d)
    map_S_2 = PCA(2, svd_solver="full").fit(h_S_d[train]).transform(h_S_d)
    of_pool = stages.predictions.iloc[rows_N]
    scores_N_C = of_pool[[f"score_{concept}" for concept in CONCEPTS]].to_numpy()
    bald_N = of_pool["bald"].to_numpy()
    pool = Pool(h_S_d[rows_N], scores_N_C, bald_N, h_S_d[train], of_pool["concept_true"].to_numpy())
    chosen = bald_kmeans(pool, min(batch, len(rows_N)), generator("fig4_pipeline"))
    return Round(rows_N, map_S_2, top(bald_N, batch * EXPANSION), chosen)
