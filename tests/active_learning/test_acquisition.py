from collections import Counter

import numpy as np
import pytest
import sklearn.cluster

from gpca.active_learning import acquisition

every_strategy = pytest.mark.parametrize("name", acquisition.STRATEGIES)


def make_pool(n=40, seed=0, **given):
    """A pool in which everything that is not given is random, as an embedding's float32."""
    random = np.random.default_rng(seed)
    columns = {
        "h_N_d": random.normal(size=(n, 4)).astype(np.float32),
        "scores_N_C": random.dirichlet(np.ones(3), n),
        "bald_N": random.uniform(size=n),
        "h_labeled_L_d": random.normal(size=(5, 4)).astype(np.float32),
        "truth_N": np.array(["noise", "pose", "overlap"])[np.arange(n) % 3],
    }
    return acquisition.Pool(**columns | given)


def selected(name, pool, batch, seed=1):
    return acquisition.select(name, pool, batch, np.random.default_rng(seed)).tolist()


def around(centers, each, seed=0):
    """Tight clusters of `each` points, the points of a center together."""
    centers = np.repeat(np.asarray(centers, float), each, axis=0)
    return centers + 0.01 * np.random.default_rng(seed).normal(size=centers.shape)


@every_strategy
@pytest.mark.parametrize(("n", "batch"), [(40, 1), (40, 4), (40, 39), (4, 4), (1, 4)])
def test_a_strategy_returns_as_many_different_rows_as_asked_for_and_repeats_them(name, n, batch):
    rows = selected(name, make_pool(n), batch)
    assert len(set(rows)) == len(rows) == min(n, batch)
    assert set(rows) <= set(range(n))
    assert selected(name, make_pool(n), batch) == rows


@every_strategy
@pytest.mark.parametrize("labeled", [0.0, 1.0], ids=["labeled elsewhere", "labeled the same"])
@pytest.mark.filterwarnings("ignore:Number of distinct clusters")
def test_identical_samples_still_give_different_rows(name, labeled):
    of_labeled = {"h_labeled_L_d": np.full((5, 4), labeled)}
    alike = {"h_N_d": np.ones((40, 4)), "scores_N_C": np.full((40, 3), 1 / 3), "bald_N": np.zeros(40)}
    assert len(set(selected(name, make_pool(**of_labeled, **alike), 4))) == 4


@pytest.mark.parametrize(
    "name", [name for name in acquisition.STRATEGIES if not acquisition.STRATEGIES[name].needs_scores]
)
def test_a_strategy_that_needs_no_scores_reads_none(name):
    blind = make_pool(scores_N_C=np.empty((40, 0)), bald_N=np.full(40, np.nan))
    assert selected(name, blind, 4) == selected(name, make_pool(), 4)


@pytest.mark.parametrize("name", [name for name in acquisition.STRATEGIES if not acquisition.STRATEGIES[name].oracle])
def test_only_an_oracle_is_told_the_truth(name):
    assert selected(name, make_pool(truth_N=np.full(40, "")), 4) == selected(name, make_pool(), 4)


SCORES = [[0.98, 0.01, 0.01], [0.48, 0.48, 0.04], [0.34, 0.33, 0.33], [0.9, 0.1, 0.0], [0.44, 0.28, 0.28]]


@pytest.mark.parametrize(
    "name, best_first", [("entropy", [2, 4, 1, 3]), ("margin", [1, 2, 4, 3]), ("bald", [3, 0, 4, 1])]
)
def test_the_most_uncertain_are_taken_most_uncertain_first(name, best_first):
    pool = make_pool(5, scores_N_C=np.array(SCORES), bald_N=np.array([0.4, 0.2, 0.1, 0.5, 0.3]))
    assert selected(name, pool, 4) == best_first


@pytest.mark.parametrize("batch", [2, 3, 5])
@pytest.mark.parametrize("seed", range(3))
def test_bald_kmeans_takes_the_middle_of_each_cluster_of_uncertain_samples(batch, seed):
    centers = 20 * np.eye(6)[:batch]
    uncertain, certain = around(centers, acquisition.EXPANSION, seed), around(-20 * np.eye(6), 5)
    random = np.random.default_rng(seed)
    order = random.permutation(len(uncertain) + len(certain))
    h = np.concatenate([uncertain, certain])[order]
    high = np.concatenate([np.ones(len(uncertain)), np.zeros(len(certain))])[order]
    pool = make_pool(len(h), h_N_d=h, bald_N=high + 0.1 * random.uniform(size=len(h)))
    expected = set()
    for center in centers:
        members = np.flatnonzero(np.linalg.norm(h - center, axis=1) < 1)
        expected.add(int(members[np.linalg.norm(h[members] - h[members].mean(axis=0), axis=1).argmin()]))
    assert set(selected("bald_kmeans", pool, batch, seed)) == expected


@pytest.mark.parametrize(("n", "d"), [(2, 2), (40, 3), (300, 17), (60, 1024)])
def test_first_centers_are_those_of_scikit_learn(n, d):
    random = np.random.default_rng(n)
    for h_n_d in (random.normal(size=(n, d)), np.round(random.normal(size=(n, d)))):
        for clusters in (1, min(20, len(np.unique(h_n_d, axis=0)))):
            _, rows = sklearn.cluster.kmeans_plusplus(h_n_d, clusters, random_state=7)
            assert acquisition.kmeans_plusplus(h_n_d, clusters, 7) == rows.tolist()


@pytest.mark.parametrize("n, clusters", [(16, 4), (10, 4), (5, 1), (3, 3)])
def test_balanced_clusters_hold_as_many_samples_each_and_none_gains_by_an_exchange(n, clusters):
    h = np.random.default_rng(n).normal(size=(n, 3))
    cluster, centers = acquisition.balanced_kmeans(h, clusters, np.random.default_rng(0))
    sizes = np.bincount(cluster, minlength=clusters)
    assert sizes.max() - sizes.min() <= 1
    assert centers == pytest.approx(np.stack([h[cluster == k].mean(axis=0) for k in range(clusters)]))
    cost = np.square(h[:, None] - centers).sum(axis=2)
    for one in range(n):
        for other in range(one):
            a, b = cluster[one], cluster[other]
            assert cost[one, a] + cost[other, b] <= cost[one, b] + cost[other, a] + 1e-9


def test_a_crowd_of_uncertain_samples_gets_as_many_labels_as_it_has_shares_of_the_candidates():
    outliers = around([[90, 0], [0, 90], [90, 90], [45, 45]], 1)
    h = np.concatenate([around([[0, 0]], 12), outliers, around([[9, 9]], 14)])
    uncertain = np.arange(30) < 16
    pool = make_pool(30, h_N_d=h, bald_N=uncertain.astype(float))
    rows = np.array(selected("bald_kmeans", pool, 4))
    assert ((rows < 12).sum(), uncertain[rows].sum()) == (3, 4)


def test_bald_kmeans_names_the_most_uncertain_first_and_bald_stochastic_draws_in_proportion():
    pool = make_pool()
    rows = acquisition.bald_kmeans(pool, 4, np.random.default_rng(0))
    assert (np.diff(pool.bald_N[rows]) <= 0).all()
    assert set(rows) <= set(acquisition.top(pool.bald_N, 4 * acquisition.EXPANSION))
    pool, random = make_pool(5, bald_N=np.array([0.0, 0.1, 0.2, 0.3, 0.4])), np.random.default_rng(0)
    draws = [acquisition.STRATEGIES["bald_stochastic"].choose(pool, 5, random).tolist() for _ in range(2000)]
    assert {rows[-1] for rows in draws} == {0}
    first = Counter(rows[0] for rows in draws)
    assert [first[row] / 2000 for row in range(1, 5)] == pytest.approx([0.1, 0.2, 0.3, 0.4], abs=0.05)


@pytest.mark.parametrize(
    ("of_each", "batch", "expected"),
    [((30, 6, 4), 3, [1, 1, 1]), ((30, 6, 4), 7, [2, 2, 3]), ((30, 6, 4), 12, [4, 4, 4]), ((30, 9, 1), 9, [1, 4, 4])],
)
def test_random_stratified_takes_as_many_of_each_class_or_all_of_a_rare_one(of_each, batch, expected):
    truth = np.repeat(["noise", "pose", "overlap"], of_each)
    counts = Counter(truth[selected("random_stratified", make_pool(truth_N=truth), batch)])
    assert sorted(counts.values()) == expected


def test_coreset_takes_the_point_farthest_from_all_labeled_then_from_that_too():
    h = around([[0, 0], [5, 0], [0, 9]], 10)
    pool = make_pool(30, h_N_d=h, h_labeled_L_d=np.zeros((2, 2)))
    rows = selected("coreset", pool, 2)
    assert rows[0] == np.linalg.norm(h, axis=1).argmax()
    assert rows[1] in range(10, 20)


def test_typiclust_takes_typical_samples_of_the_largest_clusters_without_a_label():
    h = around([[0, 0], [30, 0], [0, 30], [30, 30]], 12)[:42]  # the last cluster is the smallest
    pool = make_pool(42, h_N_d=h, h_labeled_L_d=around([[0, 0], [30, 0]], 1))
    chosen = [selected("typiclust", pool, 2, seed) for seed in range(20)]
    # k-means starts anywhere, so it does not find the four every time.
    blocks = Counter(row // 12 for rows in chosen for row in rows)
    assert blocks[2] + blocks[3] >= 30
    assert blocks[2] >= blocks[3]
    to_others = np.linalg.norm(h[24:36, None] - h[24:36], axis=2).sum(axis=1)
    typical = [to_others[row - 24] < np.median(to_others) for rows in chosen for row in rows if row // 12 == 2]
    assert np.mean(typical) > 0.8


def test_badge_prefers_uncertain_samples():
    certain = np.arange(40) % 2 == 0
    scores = np.where(certain[:, None], [0.9998, 0.0001, 0.0001], [0.4, 0.3, 0.3])
    rows = selected("badge", make_pool(scores_N_C=scores), 8)
    assert not certain[rows].any()
