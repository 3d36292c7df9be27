from dataclasses import replace

import numpy as np
import pytest

from gpca.features.distances import QUANTILES, LocalPlanes, describe_distances
from gpca.features.groups import QUANTILES as COUNT
from tests.features.conftest import moved

MIDDLE = COUNT // 2


def groups(pair):
    """The four distances, each by its quantiles."""
    return describe_distances(pair)[0].reshape(4, COUNT)


def test_there_are_52_distances_in_rising_quantiles(pair):
    assert len(QUANTILES) == COUNT
    assert (np.diff(groups(pair), axis=1) >= 0).all()


def test_a_cloud_on_itself_has_no_distances(pair):
    same = groups(replace(pair, model=pair.observed))
    assert same[:3] == pytest.approx(0, abs=1e-12)
    assert same[3, -1] > 0


def test_missing_surface_is_seen_from_the_model_alone(pair):
    half = replace(pair, observed=pair.observed[pair.observed[:, 2] > np.median(pair.observed[:, 2])])
    whole, cropped = groups(pair), groups(half)
    assert cropped[1, -1] > 2 * whole[1, -1]
    assert cropped[0, -1] < 1.5 * whole[0, -1]


def test_a_shift_along_a_plane_leaves_the_distance_from_it():
    side = np.linspace(0, 1, 20)
    x, y = (axis.ravel() for axis in np.meshgrid(side, side))
    grid = np.column_stack([x, y, np.zeros(400)])
    planes = LocalPlanes.of(grid)
    assert np.abs(planes.normals) == pytest.approx(np.tile([0, 0, 1], (400, 1)), abs=1e-6)
    assert planes.thickness == pytest.approx(0, abs=1e-7)
    from gpca.features.pair import ObservedPair

    flat = ObservedPair(grid, grid, np.eye(4), np.eye(4)[None], np.ones(1), np.zeros(1), ())
    along, across = groups(moved(flat, [0.02, 0, 0])), groups(moved(flat, [0, 0, 0.02]))
    assert along[2, MIDDLE] == pytest.approx(0, abs=1e-9) and along[0, MIDDLE] == pytest.approx(0.02)
    assert across[2, MIDDLE] == pytest.approx(0.02)


def test_noise_is_thick(pair):
    noise = np.random.default_rng(0).normal(scale=0.03, size=pair.observed.shape)
    assert groups(replace(pair, observed=pair.observed + noise))[3, MIDDLE] > 1.5 * groups(pair)[3, MIDDLE]
