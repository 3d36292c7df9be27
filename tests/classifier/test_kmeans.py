"""Against scikit-learn, to the last bit."""

import numpy as np
import pytest
import sklearn.cluster

from gpca.classifier.kmeans import kmeans, kmeans_plusplus

KINDS = {  # of samples (n, d)
    "even": lambda random, x: x,
    "clustered": lambda random, x: x + 5 * random.normal(size=(3, x.shape[1]))[random.integers(3, size=len(x))],
    "repeated": lambda random, x: x[random.integers(max(len(x) // 2, 1), size=len(x))],
    "in steps": lambda random, x: np.round(x),
    "with constant columns": lambda random, x: x * (np.arange(x.shape[1]) % 2),
}


@pytest.mark.parametrize(
    ("n", "d", "kind"),
    [
        *((n, d, kind) for n, d in ((2, 2), (9, 17), (40, 3), (300, 17)) for kind in KINDS),
        (600, 1024, "even"),
        (600, 1024, "clustered"),
        (700, 256, "even"),
    ],
)
@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_centers_are_those_of_scikit_learn(n, d, precision, kind):
    random = np.random.default_rng(n + d)
    x_n_d = KINDS[kind](random, random.normal(size=(n, d))).astype(precision)
    for clusters in {1, 2, 20, 64}:
        clusters, seed = min(clusters, len(np.unique(x_n_d, axis=0))), int(random.integers(2**32))
        _, rows = sklearn.cluster.kmeans_plusplus(x_n_d, clusters, random_state=seed)
        assert kmeans_plusplus(x_n_d, clusters, seed) == rows.tolist()
        expected = sklearn.cluster.KMeans(clusters, n_init=1, random_state=seed).fit(x_n_d).cluster_centers_
        np.testing.assert_array_equal(kmeans(x_n_d, clusters, seed), expected)


def test_an_empty_cluster_gets_the_sample_that_is_farthest_from_its_center(monkeypatch):
    x_n_d = np.random.default_rng(0).normal(size=(60, 5)).astype(np.float32)
    x_n_d[[1, 3]] = x_n_d[[0, 2]]
    monkeypatch.setattr("gpca.classifier.kmeans.kmeans_plusplus", lambda *_: [0, 1, 2, 3, 4])
    expected = sklearn.cluster.KMeans(5, init=x_n_d[:5], n_init=1).fit(x_n_d).cluster_centers_
    np.testing.assert_array_equal(kmeans(x_n_d, 5, 0), expected)
