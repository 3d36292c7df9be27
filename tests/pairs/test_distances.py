from dataclasses import replace

import numpy as np
import pytest

from gpca.causes.settings import QUANTILES
from gpca.pairs import distances
from gpca.seeds import generator
from tests.pairs.conftest import moved

MIDDLE = QUANTILES // 2


def groups(pair):
    """The four distances, each by its quantiles."""
    return distances.describe_distances(pair)[0].reshape(4, QUANTILES)


def test_distances_rise_in_quantiles_are_none_to_itself_and_show_missing_surface_from_the_model(pair):
    assert len(distances.LEVELS) == QUANTILES
    assert (np.diff(groups(pair), axis=1) >= 0).all()
    same = groups(replace(pair, model=pair.observed))
    assert same[:3] == pytest.approx(0, abs=1e-12)
    assert same[3, -1] > 0
    half = replace(pair, observed=pair.observed[pair.observed[:, 2] > np.median(pair.observed[:, 2])])
    whole, cropped = groups(pair), groups(half)
    assert cropped[1, -1] > 2 * whole[1, -1]
    assert cropped[0, -1] < 1.5 * whole[0, -1]


def test_a_shift_along_a_plane_leaves_the_distance_from_it():
    side = np.linspace(0, 1, 20)
    x, y = (axis.ravel() for axis in np.meshgrid(side, side))
    grid = np.column_stack([x, y, np.zeros(400)])
    planes = distances.LocalPlanes.of(grid)
    assert np.abs(planes.normals) == pytest.approx(np.tile([0, 0, 1], (400, 1)), abs=1e-6)
    assert planes.thickness == pytest.approx(0, abs=1e-7)
    flat = distances.ObservedPair(grid, grid, np.eye(4), np.eye(4)[None], np.ones(1), np.zeros(1), ())
    along, across = groups(moved(flat, [0.02, 0, 0])), groups(moved(flat, [0, 0, 0.02]))
    assert along[2, MIDDLE] == pytest.approx(0, abs=1e-9) and along[0, MIDDLE] == pytest.approx(0.02)
    assert across[2, MIDDLE] == pytest.approx(0.02)


@pytest.fixture(scope="module")
def sparse_pair(registrations):
    return distances.observed_once(registrations, 0, 96, generator("points"))


def told(pair, points=96):
    return distances.describe_points(pair, distances.MatchedPair.of(pair), points)


def test_a_point_is_told_where_it_is_and_how_far_the_other_cloud(sparse_pair):
    sides = told(sparse_pair)
    assert sides.shape == (2, 96, distances.CHANNELS) and sides.dtype == np.float32
    spacing = np.median(distances.MatchedPair.of(sparse_pair).model.spacing)
    for cloud, other, side in (
        (sparse_pair.observed, sparse_pair.model, sides[0]),
        (sparse_pair.model, sparse_pair.observed, sides[1]),
    ):
        assert side[:, :3] == pytest.approx(cloud, abs=1e-6)
        nearest = np.linalg.norm(cloud[:, None] - other[None], axis=2).min(axis=1)
        assert side[:, 3] == pytest.approx(np.log(np.maximum(nearest, 0.02 * spacing) / spacing), abs=1e-3)
        assert (side[:, 6] >= 0).all() and (side[:, 6] <= 1 + 1e-6).all()


def test_a_cloud_on_its_model_is_told_so_and_nothing_but_the_place_depends_on_the_size(sparse_pair):
    side = told(replace(sparse_pair, observed=sparse_pair.model))[0]
    assert side[:, 3] == pytest.approx(np.full(96, np.log(0.02)), abs=1e-4)  # no farther than what counts as nothing
    assert side[:, 5:] == pytest.approx(np.tile([0.0, 1.0], (96, 1)), abs=1e-4)  # thickness and normals agree
    twice = replace(sparse_pair, observed=2 * sparse_pair.observed, model=2 * sparse_pair.model)
    assert told(twice)[..., 3:] == pytest.approx(told(sparse_pair)[..., 3:], abs=1e-3)


def entropy(pair):
    return dict(zip(distances.ENTROPY, distances.describe_entropy(pair), strict=True))


def test_the_entropy_of_a_point_is_that_of_its_neighbors_covariance():
    points = np.random.default_rng(0).uniform(size=(200, 3))
    found = distances._entropies(points, 0.2)
    for i in range(0, 200, 17):
        near = points[np.linalg.norm(points - points[i], axis=1) <= 0.2]
        if len(near) < distances.FEWEST_NEIGHBORS:
            assert np.isnan(found[i])
        else:
            covariance = np.cov(near, rowvar=False, bias=True) + distances.ENTROPY_FLOOR * np.eye(3)
            assert found[i] == pytest.approx(0.5 * np.log(np.linalg.det(2 * np.pi * np.e * covariance)))


def test_clouds_that_do_not_lie_on_each_other_blur_when_joined_and_points_without_neighbors_do_not(pair):
    name = f"difference_{distances.RADII[-1]:g}"
    assert entropy(moved(pair, [0.04, 0, 0]))[name] > entropy(pair)[name]
    far = replace(pair, observed=100 * pair.observed, model=100 * pair.model)
    assert set(distances.describe_entropy(far)) == {0.0}


@pytest.fixture(scope="module")
def few(registrations):
    return registrations.subset(np.arange(12))


def described(registrations, **changes):
    return distances.describe_registrations(replace(registrations, **changes), "tiny", 100, points=128)


def test_groups_are_finite_and_relations_tell_the_motion_and_nothing_of_the_objects_size(few):
    groups = described(few)
    shapes = {name: (12, width) for name, width in distances.WIDTHS.items()} | {"points": (12, 2, 128, 7)}
    assert {name: array.shape for name, array in groups.items()} == shapes
    assert all(np.isfinite(array).all() for array in groups.values())
    # All lengths of a pair twice as large: its distances are twice as large, its relations as before.
    scaled = {name: 2 * getattr(few, name) for name in ("points", "target_points", "inlier_rmse")}
    twice, once = described(few, **scaled), described(few)
    assert twice["distances"] == pytest.approx(2 * once["distances"], rel=1e-4)
    assert twice["relations"][:, :30] == pytest.approx(once["relations"][:, :30], rel=1e-3, abs=1e-3)
    assert twice["densities"] == pytest.approx(once["densities"], abs=1e-4)
    moved = described(few)["relations"][:, 30:33]
    still = described(few, T_target_source_icp=few.T_target_source_init)["relations"][:, 30:33]
    assert (moved[few.concept == "pose", 0] > 0.05).all()  # radians
    assert still == pytest.approx(np.zeros((12, 3)), abs=1e-6)
