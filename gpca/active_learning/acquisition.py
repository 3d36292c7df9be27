"""Acquisition strategies by name: functions that pick the samples of a pool to label next (paper Sec. III-C)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gpca.errors import InputError
from gpca.io.arrays import require_numbers
from gpca.process.registry import Registry

EXPANSION = 4  # K: BALD with k-means clusters the B·K most uncertain samples
MOST_STEPS = 100  # of k-means


@dataclass(frozen=True)
class Pool:
    """N unlabeled samples and the classifier's scores."""

    h_N_d: np.ndarray  # embeddings, standardized
    scores_N_C: np.ndarray  # mean class probabilities (Eq. 4)
    bald_N: np.ndarray  # nats (Eq. 7)
    h_labeled_L_d: np.ndarray  # embeddings of the labeled samples
    truth_N: np.ndarray  # true classes, for oracle strategies


Choose = Callable[[Pool, int, np.random.Generator], np.ndarray]


@dataclass(frozen=True)
class Strategy:
    """A registered strategy."""

    title: str
    choose: Choose  # called with pool, batch size and generator; may return fewer rows, or repeated ones
    oracle: bool = False  # whether it reads the true classes
    needs_scores: bool = True  # whether it reads the classifier's scores


REGISTRY: Registry[Strategy] = Registry("strategy", "", "STRATEGIES", first=(__name__,), outside=Strategy)
strategies, require_strategy, strategy_module = REGISTRY.entries, REGISTRY.entry, REGISTRY.module


def select(name: str, pool: Pool, batch: int, random: np.random.Generator) -> np.ndarray:
    """Return `batch` different rows of the pool, or all if there are fewer.

    If a strategy returns too few, as some do for identical embeddings, the others are drawn at random.
    """
    strategy = require_strategy(name)
    wanted = min(batch, len(pool.h_N_d))
    if wanted == len(pool.h_N_d):
        return np.arange(wanted)
    answer: object = strategy.choose(pool, wanted, random)
    if isinstance(answer, list) and all(isinstance(row, int | np.integer) for row in answer):
        answer = np.array(answer, dtype=int)
    rows = require_numbers(answer, (None,), f"strategy '{name}': its rows", "iu")
    if not ((rows >= 0) & (rows < len(pool.h_N_d))).all():
        raise InputError(f"strategy '{name}'", f"returns rows that a pool of {len(pool.h_N_d)} has not", "correct it")
    chosen = np.array(list(dict.fromkeys(rows.tolist())), dtype=int)
    others = np.setdiff1d(np.arange(len(pool.h_N_d)), chosen)
    return np.concatenate([chosen, random.permutation(others)])[:wanted]


def top(values_N: np.ndarray, n: int) -> np.ndarray:
    """Return the rows of the n largest values, largest first; ties in order."""
    return np.argsort(-values_N, kind="stable")[:n]


def random_stratified(pool: Pool, batch: int, random: np.random.Generator) -> np.ndarray:
    """Draw equally many of each true class, as far as possible."""
    order = random.permutation(len(pool.h_N_d))
    rank_N = np.empty(len(order))  # of each row within its class, in random order
    for name in np.unique(pool.truth_N):
        rows = order[pool.truth_N[order] == name]
        rank_N[rows] = np.arange(len(rows))
    tie_N = random.permutation(len(order))
    return np.lexsort([tie_N, rank_N])[:batch]


def by_scores(method: str) -> Choose:
    """Take the largest predictive entropies H[ŝ], or the smallest differences of the two largest scores."""

    def choose(pool: Pool, batch: int, _random: np.random.Generator) -> np.ndarray:
        from skactiveml.pool import uncertainty_scores

        return top(uncertainty_scores(pool.scores_N_C, method=method), batch)

    return choose


def bald_kmeans(pool: Pool, batch: int, random: np.random.Generator) -> np.ndarray:
    """Of B clusters of K samples, those of largest BALD, the nearest to each centroid, most uncertain first (III-C)."""
    candidates = top(pool.bald_N, batch * EXPANSION)
    h_n_d = pool.h_N_d[candidates]
    cluster_n, centers_B_d = balanced_kmeans(h_n_d, batch, random)
    distance_n = np.square(h_n_d - centers_B_d[cluster_n]).sum(axis=1)
    nearest = [min(np.flatnonzero(cluster_n == cluster), key=distance_n.__getitem__) for cluster in range(batch)]
    return candidates[sorted(nearest)]


def kmeans_plusplus(x_n_d: np.ndarray, clusters: int, seed: int) -> list[int]:
    """Return the rows of first centers by k-means++ (Arthur and Vassilvitskii 2007), as scikit-learn chooses them."""
    random, square_n, n = np.random.RandomState(seed), np.einsum("nd,nd->n", x_n_d, x_n_d), len(x_n_d)

    def distances(rows: np.ndarray) -> np.ndarray:
        return np.maximum(-2 * (x_n_d[rows] @ x_n_d.T) + square_n[rows, None] + square_n, 0)

    chosen = [int(random.choice(n, p=np.full(n, 1 / n)))]
    nearest_1_n = distances(np.array(chosen))
    while len(chosen) < clusters:
        drawn = random.uniform(size=2 + int(np.log(clusters))) * (nearest_1_n @ np.ones(n))
        tried_T = np.clip(np.searchsorted(np.cumsum(nearest_1_n), drawn), None, n - 1)
        nearest_T_n = np.minimum(nearest_1_n, distances(tried_T))
        best = np.argmin(nearest_T_n @ np.ones(n))
        nearest_1_n = nearest_T_n[best]
        chosen.append(int(tried_T[best]))
    return chosen


def balanced_kmeans(h_n_d: np.ndarray, clusters: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Clusters (n,) of equally many samples each at the least cost (Malinen and Fränti 2014), and centroids (B, d)."""
    from scipy.optimize import linear_sum_assignment
    from scipy.spatial.distance import cdist

    h_n_d = h_n_d.astype(float)
    centers_B_d = h_n_d[kmeans_plusplus(h_n_d, clusters, int(random.integers(2**31)))]
    slot_n = np.arange(len(h_n_d)) % clusters  # cluster of each slot
    cluster_n = np.full(len(h_n_d), -1)
    for _ in range(MOST_STEPS):
        _, assigned_n = linear_sum_assignment(cdist(h_n_d, centers_B_d, "sqeuclidean")[:, slot_n])
        before_n, cluster_n = cluster_n, slot_n[assigned_n]
        if np.array_equal(before_n, cluster_n):
            break
        centers_B_d = np.stack([h_n_d[cluster_n == cluster].mean(axis=0) for cluster in range(clusters)])
    return cluster_n, centers_B_d


def badge(pool: Pool, batch: int, random: np.random.Generator) -> np.ndarray:
    """k-means++ over the gradients of the last layer for the predicted label (Ash et al. 2020)."""
    from skactiveml.base import SkactivemlClassifier
    from skactiveml.pool import Badge

    class Scored(SkactivemlClassifier):  # BADGE asks a classifier for probabilities
        def fit(self, *_data):
            return self

        def predict_proba(self, _h_N_d):
            return pool.scores_N_C

    unlabeled_N = np.full(len(pool.h_N_d), np.nan)
    strategy = Badge(random_state=int(random.integers(2**31)))
    return strategy.query(pool.h_N_d, unlabeled_N, Scored(), fit_clf=False, batch_size=batch)


def coreset(pool: Pool, batch: int, random: np.random.Generator) -> np.ndarray:
    """Take the samples farthest from all labeled ones, one after the other (Sener & Savarese 2018)."""
    from skactiveml.pool import CoreSet

    return _with_labeled(CoreSet(random_state=int(random.integers(2**31))), pool, batch)


def typiclust(pool: Pool, batch: int, random: np.random.Generator) -> np.ndarray:
    """Take the most typical sample of each of the largest unlabeled clusters (Hacohen et al. 2022)."""
    from skactiveml.pool import TypiClust

    options = {"n_init": 1, "max_iter": 20, "init": "random"}  # k-means++ would dominate the runtime
    strategy = TypiClust(random_state=int(random.integers(2**31)), cluster_algo_dict=options)
    try:
        return _with_labeled(strategy, pool, batch)
    except UnboundLocalError:  # scikit-activeml 1.0.1 raises it if every cluster has a labeled sample
        return np.array([], dtype=int)


def _with_labeled(strategy, pool: Pool, batch: int) -> np.ndarray:
    """Query a strategy that reads the embeddings of the labeled samples, not their labels."""
    labels = np.repeat([np.nan, 0], [len(pool.h_N_d), len(pool.h_labeled_L_d)])
    return strategy.query(np.concatenate([pool.h_N_d, pool.h_labeled_L_d]), labels, batch_size=batch)


def power_bald(pool: Pool, batch: int, random: np.random.Generator) -> np.ndarray:
    """Draw without replacement in proportion to BALD (Kirsch et al. 2023, β = 1) by Gumbel top-k."""
    return top(np.log(np.maximum(pool.bald_N, 1e-12)) + random.gumbel(size=len(pool.bald_N)), batch)


BLIND = {"needs_scores": False}
STRATEGIES = {
    "random": Strategy("Random", lambda pool, batch, random: random.permutation(len(pool.h_N_d))[:batch], **BLIND),
    "random_stratified": Strategy("Stratified random (knows the truth)", random_stratified, oracle=True, **BLIND),
    "entropy": Strategy("Entropy", by_scores("entropy")),
    "margin": Strategy("Margin", by_scores("margin_sampling")),
    "bald": Strategy("BALD", lambda pool, batch, random: top(pool.bald_N, batch)),
    "bald_kmeans": Strategy("BALD + k-means (paper)", bald_kmeans),
    "bald_stochastic": Strategy("PowerBALD", power_bald),
    "badge": Strategy("BADGE", badge),
    "coreset": Strategy("CoreSet", coreset, **BLIND),
    "typiclust": Strategy("TypiClust", typiclust, **BLIND),
}

STREAMS = {
    "stream_random": "Stream, random",
    "stream_bald": "Stream, BALD over a threshold",
    "stream_clever": "Stream, Bayesian layer (after CLEVER)",
}
