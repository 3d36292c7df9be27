"""Which samples of a pool are worth a label: one function per strategy, found by name (paper Sec. III-C).

A strategy gets the pool, the batch size B and a random generator, and returns rows of the pool, best first. Entropy,
margin, BADGE, CoreSet and TypiClust are scikit-activeml's; BALD needs no ensemble here, the GP's posterior is one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gpca.errors import require_known
from gpca.plugins import joined_outside, module_outside

EXPANSION = 4  # K: BALD with k-means forms clusters of K of the B·K most uncertain samples


@dataclass(frozen=True)
class Pool:
    """N samples without a label, and the classifier's scores for them.

    Attributes:
        h_N_d: embeddings, standardized.
        scores_N_C, bald_N: mean class probabilities (Eq. 4) and BALD in nats (Eq. 7).
        h_labeled_L_d: embeddings of the samples with a label.
        truth_N: the true classes, for strategies that are an upper bound.
    """

    h_N_d: np.ndarray
    scores_N_C: np.ndarray
    bald_N: np.ndarray
    h_labeled_L_d: np.ndarray
    truth_N: np.ndarray


@dataclass(frozen=True)
class Strategy:
    """A strategy by name.

    Attributes:
        title: what tables and figures call it.
        choose: called with pool, batch size and generator; may return fewer rows, or one twice.
        oracle: whether it is told the truth about the pool.
        needs_scores: whether it reads the classifier's scores of the pool.
    """

    title: str
    choose: Callable[[Pool, int, np.random.Generator], np.ndarray]
    oracle: bool = False
    needs_scores: bool = True


def strategies() -> dict[str, Strategy]:
    """Return every strategy by name, those from outside included."""
    return joined_outside("STRATEGIES", "strategy", Strategy, STRATEGIES)


def strategy_module(name: str) -> str | None:
    """Return the module from outside that lists the strategy; None of one of the suite's own."""
    return module_outside("STRATEGIES", "strategy", Strategy, name)


def require_strategy(name: str) -> Strategy:
    """Return the strategy of that name; an unknown one raises an InputError that lists the known."""
    require_known("strategy", name, strategies())
    return strategies()[name]


def select(name: str, pool: Pool, batch: int, random: np.random.Generator) -> np.ndarray:
    """Return `batch` different rows of the pool, all where it has no more.

    Where a strategy names too few, as some do among identical embeddings, the rest is drawn at random.
    """
    strategy = require_strategy(name)
    wanted = min(batch, len(pool.h_N_d))
    if wanted == len(pool.h_N_d):
        return np.arange(wanted)
    chosen = np.array(list(dict.fromkeys(map(int, strategy.choose(pool, wanted, random)))), dtype=int)
    others = np.setdiff1d(np.arange(len(pool.h_N_d)), chosen)
    return np.concatenate([chosen, random.permutation(others)])[:wanted]


def top(values_N: np.ndarray, n: int) -> np.ndarray:
    """Return the rows of the n largest values, largest first, the first of equals."""
    return np.argsort(-values_N, kind="stable")[:n]


def random_rows(pool: Pool, batch: int, random: np.random.Generator) -> np.ndarray:
    """Draw at random."""
    return random.permutation(len(pool.h_N_d))[:batch]


def random_stratified(pool: Pool, batch: int, random: np.random.Generator) -> np.ndarray:
    """Draw as many of each true class as can be: what random drawing does with luck."""
    order = random.permutation(len(pool.h_N_d))
    place_N = np.empty(len(order))  # each row's place within its class, in random order
    for name in np.unique(pool.truth_N):
        of_class = order[pool.truth_N[order] == name]
        place_N[of_class] = np.arange(len(of_class))
    tie_N = random.permutation(len(order))
    return np.lexsort([tie_N, place_N])[:batch]


def entropy(pool: Pool, batch: int, _random: np.random.Generator) -> np.ndarray:
    """Take the largest predictive entropies H[ŝ]."""
    from skactiveml.pool import uncertainty_scores

    return top(uncertainty_scores(pool.scores_N_C, method="entropy"), batch)


def margin(pool: Pool, batch: int, _random: np.random.Generator) -> np.ndarray:
    """Take the smallest differences of the two largest scores."""
    from skactiveml.pool import uncertainty_scores

    return top(uncertainty_scores(pool.scores_N_C, method="margin_sampling"), batch)


def bald(pool: Pool, batch: int, _random: np.random.Generator) -> np.ndarray:
    """Take the largest BALD (Houlsby et al. 2011)."""
    return top(pool.bald_N, batch)


def bald_kmeans(pool: Pool, batch: int, random: np.random.Generator) -> np.ndarray:
    """Cluster the B·K largest BALD into B clusters of K each and take the sample nearest to each centroid (Sec. III-C).

    The most uncertain of these comes first.
    """
    candidates = top(pool.bald_N, batch * EXPANSION)
    h_n_d = pool.h_N_d[candidates]
    cluster_n, centers_B_d = balanced_kmeans(h_n_d, batch, random)
    distance_n = np.square(h_n_d - centers_B_d[cluster_n]).sum(axis=1)
    nearest = [min(np.flatnonzero(cluster_n == cluster), key=distance_n.__getitem__) for cluster in range(batch)]
    return candidates[sorted(nearest)]


def balanced_kmeans(
    h_n_d: np.ndarray, clusters: int, random: np.random.Generator, most: int = 100
) -> tuple[np.ndarray, np.ndarray]:
    """Return the cluster (n,) of each sample and the centroids (B, d); sizes of clusters differ by one at most.

    K-means in which the assignment to the centroids is the cheapest one with as many samples in each cluster
    (Malinen and Fränti 2014). It ends after `most` passes at the latest.
    """
    from scipy.optimize import linear_sum_assignment  # here, because the workflow imports this file only for the names
    from scipy.spatial.distance import cdist
    from sklearn.cluster import kmeans_plusplus

    h_n_d = h_n_d.astype(float)
    centers_B_d, _ = kmeans_plusplus(h_n_d, clusters, random_state=int(random.integers(2**31)))
    place_n = np.arange(len(h_n_d)) % clusters  # of each place, its cluster
    cluster_n = np.full(len(h_n_d), -1)
    for _ in range(most):
        _, assigned_n = linear_sum_assignment(cdist(h_n_d, centers_B_d, "sqeuclidean")[:, place_n])
        before_n, cluster_n = cluster_n, place_n[assigned_n]
        if np.array_equal(before_n, cluster_n):
            break
        centers_B_d = np.stack([h_n_d[cluster_n == cluster].mean(axis=0) for cluster in range(clusters)])
    return cluster_n, centers_B_d


def bald_stochastic(pool: Pool, batch: int, random: np.random.Generator) -> np.ndarray:
    """Draw without replacement with probability proportional to BALD: PowerBALD (Kirsch et al. 2023), β = 1.

    By the Gumbel-top-k trick; as good as BatchBALD in their comparison, without its joint entropies.
    """
    return top(np.log(np.maximum(pool.bald_N, 1e-12)) + random.gumbel(size=len(pool.bald_N)), batch)


def badge(pool: Pool, batch: int, random: np.random.Generator) -> np.ndarray:
    """Run k-means++ over the gradients of the last layer for the predicted label (Ash et al. 2020)."""
    from skactiveml.base import SkactivemlClassifier
    from skactiveml.pool import Badge

    class Scored(SkactivemlClassifier):  # BADGE asks a classifier for probabilities; ours are known already
        def fit(self, *_data):
            return self

        def predict_proba(self, _h_N_d):
            return pool.scores_N_C

    unlabeled_N = np.full(len(pool.h_N_d), np.nan)
    strategy = Badge(random_state=int(random.integers(2**31)))
    return strategy.query(pool.h_N_d, unlabeled_N, Scored(), fit_clf=False, batch_size=batch)


def coreset(pool: Pool, batch: int, random: np.random.Generator) -> np.ndarray:
    """Take the samples farthest from everything labeled, one after the other (Sener & Savarese 2018)."""
    from skactiveml.pool import CoreSet

    return _with_labeled(CoreSet(random_state=int(random.integers(2**31))), pool, batch)


def typiclust(pool: Pool, batch: int, random: np.random.Generator) -> np.ndarray:
    """Take the most typical sample of each of the largest clusters without a label (Hacohen et al. 2022)."""
    from skactiveml.pool import TypiClust

    options = {"n_init": 1, "max_iter": 20, "init": "random"}  # k-means++ of that many clusters takes all the time
    strategy = TypiClust(random_state=int(random.integers(2**31)), cluster_algo_dict=options)
    try:
        return _with_labeled(strategy, pool, batch)
    except UnboundLocalError:  # scikit-activeml 1.0.1 raises it where every cluster holds a labeled sample
        return np.array([], dtype=int)


def _with_labeled(strategy, pool: Pool, batch: int) -> np.ndarray:
    """Query a strategy that reads the positions of the labeled samples, not their labels."""
    labels = np.concatenate([np.full(len(pool.h_N_d), np.nan), np.zeros(len(pool.h_labeled_L_d))])
    return strategy.query(np.concatenate([pool.h_N_d, pool.h_labeled_L_d]), labels, batch_size=batch)


STRATEGIES = {
    "random": Strategy("Random", random_rows, needs_scores=False),
    "random_stratified": Strategy(
        "Stratified random (told the truth)", random_stratified, oracle=True, needs_scores=False
    ),
    "entropy": Strategy("Entropy", entropy),
    "margin": Strategy("Margin", margin),
    "bald": Strategy("BALD", bald),
    "bald_kmeans": Strategy("BALD + k-means (paper)", bald_kmeans),
    "bald_stochastic": Strategy("PowerBALD", bald_stochastic),
    "badge": Strategy("BADGE", badge),
    "coreset": Strategy("CoreSet", coreset, needs_scores=False),
    "typiclust": Strategy("TypiClust", typiclust, needs_scores=False),
}

STREAMS = {
    "stream_random": "Stream, random",
    "stream_bald": "Stream, BALD over a threshold",
    "stream_narr": "Stream, Mondrian forest (after Narr et al.)",
    "stream_clever": "Stream, Bayesian layer (after CLEVER)",
}
