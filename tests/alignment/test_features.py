import numpy as np

from gpca.alignment.features import MOST_NEIGHBORS, RADIUS, estimate_normals, fpfh_of_pair, mutual_matches
from gpca.alignment.methods.interface import Pair
from gpca.rigid import exp, rotate, transform

from .methods.pairs import clouds


def test_features_move_with_the_cloud_and_matches_are_each_others_nearest(objects):
    source, target, source_normals, target_normals = clouds(objects, 0)
    T = exp(np.array([[0.5, -1.0, 2.0, 3.0, 2.0, 1.0]]))[0]
    moved = Pair(transform(T, source), source, np.eye(4), rotate(T, source_normals), source_normals)
    pair = Pair(source, target, np.eye(4), source_normals, target_normals)
    moved, features = (each.data for each in fpfh_of_pair(moved, RADIUS, MOST_NEIGHBORS)[1])
    _, others = (each.data for each in fpfh_of_pair(pair, RADIUS, MOST_NEIGHBORS)[1])
    assert features.shape == (33, len(source))
    assert np.abs(moved - features).max() < 0.1 * np.abs(features).max()
    distance = np.linalg.norm(features.T[:, None] - others.T, axis=2)
    rows = mutual_matches(features.T, others.T, 1000)
    assert 10 < len(rows) < len(source)
    for one, other in rows:
        assert distance[one, other] == distance[one].min() == distance[:, other].min()
    few = mutual_matches(features.T, others.T, 5)
    assert len(few) == 5 and {tuple(row) for row in few} <= {tuple(row) for row in rows}
    assert distance[tuple(few.T)].max() <= np.sort(distance[tuple(rows.T)])[4]


def test_normals_of_an_ellipsoid_point_outward():
    points = np.random.default_rng(0).normal(size=(2000, 3))
    points *= np.array([0.5, 0.4, 0.3]) / np.linalg.norm(points, axis=1, keepdims=True)
    truth = points / np.square([0.5, 0.4, 0.3])
    truth /= np.linalg.norm(truth, axis=1, keepdims=True)
    normals = estimate_normals(points + np.array([1.0, 2.0, 3.0]))
    assert ((normals * truth).sum(axis=1) > 0.97).mean() > 0.99
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)
