"""Distances of samples to the training samples, in a space of features that is the same for every learner."""

from __future__ import annotations

import numpy as np

PRINCIPAL_COMPONENTS = 16  # components in which embeddings are compared


def knn_distance(train_N_F: np.ndarray, query_S_F: np.ndarray, neighbours: int = 10) -> np.ndarray:
    """Return the mean Euclidean distance (S,) to the nearest training samples, all features standardized on these.

    Where there are fewer than `neighbours` training samples, to all of them.
    """
    from sklearn.neighbors import NearestNeighbors
    from sklearn.preprocessing import StandardScaler

    scaler = StandardScaler().fit(train_N_F)
    nearest = NearestNeighbors(n_neighbors=min(neighbours, len(train_N_F))).fit(scaler.transform(train_N_F))
    return nearest.kneighbors(scaler.transform(query_S_F))[0].mean(axis=1)


def mahalanobis_distance(train_N_F: np.ndarray, query_S_F: np.ndarray) -> np.ndarray:
    """Return the distance (S,) to the mean of the training samples in units of their scatter.

    The covariance is that of the standardized features, shrunk after Ledoit & Wolf (2004).
    """
    from scipy.linalg import pinvh
    from sklearn.covariance import ledoit_wolf
    from sklearn.preprocessing import StandardScaler

    scaler = StandardScaler().fit(train_N_F)
    precision_F_F = pinvh(ledoit_wolf(scaler.transform(train_N_F))[0])
    offsets_S_F = scaler.transform(query_S_F)
    return np.sqrt(np.maximum(np.einsum("sf,fg,sg->s", offsets_S_F, precision_F_F, offsets_S_F), 0))


def principal_components(train_N_d: np.ndarray, query_S_d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return both in the leading principal components of the standardized training embeddings."""
    from sklearn.decomposition import PCA
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    components = min(PRINCIPAL_COMPONENTS, *train_N_d.shape)
    reduction = make_pipeline(StandardScaler(), PCA(components, svd_solver="full")).fit(train_N_d)
    return reduction.transform(train_N_d), reduction.transform(query_S_d)
