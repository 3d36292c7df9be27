from dataclasses import replace

import numpy as np
import pytest

from gpca.features.entropy import ENTROPY, FEWEST_NEIGHBORS, FLOOR, RADII, _entropies, describe_entropy
from tests.features.conftest import moved


def entropy(pair):
    return dict(zip(ENTROPY, describe_entropy(pair), strict=True))


def test_the_entropy_of_a_point_is_that_of_its_neighbors_covariance():
    points = np.random.default_rng(0).uniform(size=(200, 3))
    found = _entropies(points, 0.2)
    for i in range(0, 200, 17):
        near = points[np.linalg.norm(points - points[i], axis=1) <= 0.2]
        if len(near) < FEWEST_NEIGHBORS:
            assert np.isnan(found[i])
        else:
            covariance = np.cov(near, rowvar=False, bias=True) + FLOOR * np.eye(3)
            assert found[i] == pytest.approx(0.5 * np.log(np.linalg.det(2 * np.pi * np.e * covariance)))


def test_clouds_that_do_not_lie_on_each_other_blur_when_joined(pair):
    name = f"difference_{RADII[-1]:g}"
    assert entropy(moved(pair, [0.04, 0, 0]))[name] > entropy(pair)[name]


def test_points_without_neighbors_have_none(pair):
    far = replace(pair, observed=100 * pair.observed, model=100 * pair.model)
    assert set(describe_entropy(far)) == {0.0}
