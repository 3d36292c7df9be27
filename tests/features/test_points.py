from dataclasses import replace

import numpy as np
import pytest

from gpca.features.distances import MatchedPair
from gpca.features.points import CHANNELS, describe_points
from gpca.features.registered import observed_once
from gpca.seeds import generator


@pytest.fixture(scope="module")
def pair(registrations):
    return observed_once(registrations, 0, 96, generator("points"))


def told(pair, points=96):
    return describe_points(pair, MatchedPair.of(pair), points)


def test_a_point_is_told_where_it_is_and_how_far_the_other_cloud(pair):
    sides = told(pair)
    assert sides.shape == (2, 96, CHANNELS) and sides.dtype == np.float32
    spacing = np.median(MatchedPair.of(pair).model.spacing)
    for cloud, other, side in ((pair.observed, pair.model, sides[0]), (pair.model, pair.observed, sides[1])):
        assert side[:, :3] == pytest.approx(cloud, abs=1e-6)
        nearest = np.linalg.norm(cloud[:, None] - other[None], axis=2).min(axis=1)
        assert side[:, 3] == pytest.approx(np.log(np.maximum(nearest, 0.02 * spacing) / spacing), abs=1e-3)
        assert (side[:, 6] >= 0).all() and (side[:, 6] <= 1 + 1e-6).all()


def test_a_cloud_that_lies_on_its_model_is_told_so(pair):
    side = told(replace(pair, observed=pair.model))[0]
    assert side[:, 3] == pytest.approx(np.full(96, np.log(0.02)), abs=1e-4)  # no farther than what counts as nothing
    assert side[:, 5:] == pytest.approx(np.tile([0.0, 1.0], (96, 1)), abs=1e-4)  # thickness and normals agree


def test_what_is_told_besides_the_place_does_not_depend_on_the_objects_size(pair):
    twice = replace(pair, observed=2 * pair.observed, model=2 * pair.model)
    assert told(twice)[..., 3:] == pytest.approx(told(pair)[..., 3:], abs=1e-3)


def test_a_cloud_of_fewer_points_repeats_some(pair):
    few = told(replace(pair, observed=pair.observed[:40]))
    assert np.array_equal(few[0, 40:80], few[0, :40])
    assert len(np.unique(few[1, :, :3], axis=0)) == 96
