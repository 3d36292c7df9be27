"""k-means to the bits of scikit-learn's in one thread, which takes two seconds to import."""

from math import sqrt

import numpy as np

TOLERANCE = 1e-4  # of the squared shifts of all centers, in mean variances of a coordinate
MOST_STEPS = 300
ROWS = 256  # whose distances are computed together
LEAST_NUMBERS = 10 * 2**17  # that distances in double precision may take


def kmeans(x_n_d: np.ndarray, clusters: int, seed: int) -> np.ndarray:
    """Return the centers (clusters, d) of Lloyd's algorithm from :func:`kmeans_plusplus`."""
    from scipy.linalg import get_blas_funcs

    gemm = get_blas_funcs("gemm", (x_n_d,))
    limit, mean_d = np.mean(np.var(x_n_d, axis=0)) * TOLERANCE, x_n_d.mean(axis=0)
    x_n_d = x_n_d - mean_d
    centers_k_d, cluster_n = x_n_d[kmeans_plusplus(x_n_d, clusters, seed)], np.full(len(x_n_d), -1)
    for _ in range(MOST_STEPS):
        square_k = np.einsum("kd,kd->k", centers_k_d, centers_k_d)
        nearest = []
        for rows_r_d in np.split(x_n_d, range(ROWS, len(x_n_d), ROWS)):
            square_k_r = np.repeat(square_k[None], len(rows_r_d), axis=0).T
            nearest.append(gemm(-2, centers_k_d.T, rows_r_d.T, beta=1, c=square_k_r, trans_a=True).argmin(axis=0))
        before_n, cluster_n = cluster_n, np.concatenate(nearest)
        before_k_d, centers_k_d = centers_k_d, _means(x_n_d, cluster_n, centers_k_d)
        if np.array_equal(cluster_n, before_n) or np.square(before_k_d - centers_k_d).sum() <= limit:
            break
    return centers_k_d + mean_d


def _means(x_n_d: np.ndarray, cluster_n: np.ndarray, centers_k_d: np.ndarray) -> np.ndarray:
    """Return the means of clusters; an empty one gets a sample that is far from its center."""
    sum_k_d, count_k = np.zeros_like(centers_k_d), np.bincount(cluster_n, minlength=len(centers_k_d))
    np.add.at(sum_k_d, cluster_n, x_n_d)
    if (empty := np.flatnonzero(count_k == 0)).size:
        distance_n = np.square(x_n_d - centers_k_d[cluster_n]).sum(axis=1)
        for cluster, row in zip(empty, np.argpartition(distance_n, -empty.size)[: -empty.size - 1 : -1], strict=True):
            sum_k_d[cluster_n[row]] -= x_n_d[row]
            count_k[cluster_n[row]] -= 1
            sum_k_d[cluster], count_k[cluster] = x_n_d[row], 1
    return sum_k_d * (1 / count_k[:, None]).astype(x_n_d.dtype)


def kmeans_plusplus(x_n_d: np.ndarray, clusters: int, seed: int) -> list[int]:
    """Return the rows of first centers by k-means++ (Arthur and Vassilvitskii 2007), as scikit-learn chooses them."""
    random = np.random.RandomState(seed)
    n, weight_n = len(x_n_d), np.ones(len(x_n_d), x_n_d.dtype)
    chosen = [int(random.choice(n, p=weight_n / weight_n.sum()))]
    nearest_1_n = _squared_distances(x_n_d, chosen)
    total = nearest_1_n @ weight_n
    while len(chosen) < clusters:
        drawn = random.uniform(size=2 + int(np.log(clusters))) * total
        tried_T = np.clip(np.searchsorted(np.cumsum(nearest_1_n), drawn), None, n - 1)
        nearest_T_n = np.minimum(nearest_1_n, _squared_distances(x_n_d, tried_T))
        totals_T_1 = nearest_T_n @ weight_n[:, None]
        best = np.argmin(totals_T_1)
        total, nearest_1_n = totals_T_1[best], nearest_T_n[best]
        chosen.append(int(tried_T[best]))
    return chosen


def _squared_distances(x_n_d: np.ndarray, rows: list[int] | np.ndarray) -> np.ndarray:
    """Return the squared distances (rows, n) to all, computed in double precision and in parts if they are single."""
    (n, d), part = x_n_d.shape, len(x_n_d)
    if x_n_d.dtype == np.float32:
        most = max(((len(rows) + n) * d + len(rows) * n) / 10, LEAST_NUMBERS)
        part = max(int(sqrt(d**2 + most) - d), 1)
    from_r_d = x_n_d[rows].astype(float)
    square_r_1 = np.einsum("rd,rd->r", from_r_d, from_r_d)[:, None]
    parts = []
    for to_p_d in np.split(x_n_d.astype(float), range(part, n, part)):
        parts.append(-2 * (from_r_d @ to_p_d.T) + square_r_1 + np.einsum("pd,pd->p", to_p_d, to_p_d))
    return np.maximum(np.concatenate(parts, axis=1).astype(x_n_d.dtype), 0)
