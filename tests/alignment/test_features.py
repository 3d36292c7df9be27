import numpy as np

from gpca.alignment.features import estimate_normals, fpfh, mutual_matches
from gpca.alignment.rigid import exp, rotate, transform
from gpca.process.environment import open3d_cloud

from .methods.pairs import clouds


def test_features_move_with_the_cloud_and_matches_are_each_others_nearest(objects):
    source, target, source_normals, target_normals = clouds(objects, 0)
    features = fpfh(open3d_cloud(source, source_normals)).data
    assert features.shape == (33, len(source))
    T = exp(np.array([[0.5, -1.0, 2.0, 3.0, 2.0, 1.0]]))[0]
    moved = fpfh(open3d_cloud(transform(T, source), rotate(T, source_normals))).data
    assert np.abs(moved - features).max() < 0.1 * np.abs(features).max()

    others = fpfh(open3d_cloud(target, target_normals)).data
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
