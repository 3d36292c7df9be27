import numpy as np

from gpca.alignment.normals import estimate_normals


def test_normals_of_an_ellipsoid_point_outward():
    points = np.random.default_rng(0).normal(size=(2000, 3))
    points *= np.array([0.5, 0.4, 0.3]) / np.linalg.norm(points, axis=1, keepdims=True)
    truth = points / np.square([0.5, 0.4, 0.3])
    truth /= np.linalg.norm(truth, axis=1, keepdims=True)
    normals = estimate_normals(points + np.array([1.0, 2.0, 3.0]))
    assert ((normals * truth).sum(axis=1) > 0.97).mean() > 0.99
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)
