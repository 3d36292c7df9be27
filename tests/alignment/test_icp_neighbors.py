import numpy as np
import pytest
from scipy.spatial import cKDTree

from gpca.alignment import batched_icp
from gpca.alignment.batched_icp import make_target
from gpca.alignment.icp_kernels import LISTED, nearest

RANDOM = np.random.default_rng(0)
ON_SPHERE = RANDOM.normal(size=(250, 3))
ON_SPHERE *= 0.5 / np.linalg.norm(ON_SPHERE, axis=1, keepdims=True)
INSIDE = RANDOM.uniform(-0.5, 0.5, size=(200, 3))
CLOUDS = {
    "surface": ON_SPHERE,
    "far from the origin": ON_SPHERE + np.array([40.0, -70.0, 100.0]),
    "volume": INSIDE,
    "plane": INSIDE * [1.0, 0.7, 0.0],
    "tilted plane": INSIDE @ np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]]),
    "line": INSIDE * [0.0, 1.0, 0.0],
    "two clusters": INSIDE * 0.01 + np.where(np.arange(200) % 2, 0.5, -0.5)[:, None],
    "three points": INSIDE[:3],
    "duplicates": np.repeat(INSIDE[:40], 5, axis=0),
    "one point many times": np.tile(INSIDE[:1], (30, 1)),
    "lattice": np.stack(np.meshgrid(*[np.linspace(-0.5, 0.5, 6)] * 3), axis=-1).reshape(-1, 3),
}
DISTANCES = (1e-6, 0.02, 0.1, 0.7, 20.0)


def queries(points, distance):
    """Positions on, near, between and around the points, at the very edge of the box and far beyond it."""
    random = np.random.default_rng(1)
    middle, extent = points.mean(axis=0), max(np.ptp(points, axis=0).max(), 1e-3)
    near = points[random.integers(len(points), size=60)]
    sign = random.choice([-1.0, 1.0], size=(20, 3))
    return np.concatenate(
        [
            points[:20],
            (points[:20] + points[-20:][: len(points[:20])]) / 2,
            near + random.normal(scale=0.3 * distance, size=near.shape),
            near + random.normal(scale=0.05 * extent, size=near.shape),
            middle + random.uniform(-1, 1, size=(60, 3)) * extent,
            middle + sign * (extent / 2 + distance) * random.uniform(0.99, 1.01, size=(20, 3)),
            points.min(axis=0) - distance * np.array([[0, 0, 0], [1, 1, 1], [1, 0, 0]]),
            points.max(axis=0) + distance * np.array([[0, 0, 0], [1, 1, 1], [0, 0, 1]]),
            middle + sign * 1e3 * (extent + distance),
        ]
    )


def check(target, found_at):
    """Every neighbour is the true one and remains it within the radius, up to rounding."""
    random = np.random.default_rng(2)
    tree, room = cKDTree(target.points), np.empty(LISTED)
    within = 1e-12 * (1 + target.distance + np.abs(target.points).max())
    same, radii = [], []
    for query in found_at:
        row, radius = nearest(*query, room, *target)
        true, true_row = tree.query(query)
        if row >= 0:
            assert true < target.distance + within
            same.append(row == true_row)
        direction = random.normal(size=3)
        moved = query + direction * radius * random.choice([0.5, 0.999]) / np.linalg.norm(direction)
        for at in (query, moved):
            away = target.distance if row < 0 else np.linalg.norm(target.points[row] - at)
            assert tree.query(at)[0] >= away - within
        radii.append(radius)
    return np.array(same), np.array(radii)


@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize("cloud", CLOUDS)
def test_neighbors_are_those_of_a_tree_and_keep_within_the_radius(cloud, distance):
    points = CLOUDS[cloud]
    target = make_target(points, distance)
    same, radii = check(target, queries(points, distance))
    assert len(same) >= 20  # the points themselves, at the least, have a neighbour
    assert (radii >= 0).all()
    if cloud in ("surface", "volume", "plane", "tilted plane", "line", "three points"):
        # Random points: hardly ever two of them equally near.
        assert same.mean() > 0.99


def test_positions_that_only_some_lists_know_have_a_positive_radius():
    """The shortcut works: most positions are answered together with room to move."""
    target = make_target(ON_SPHERE, 0.1)
    near = ON_SPHERE + np.random.default_rng(3).normal(scale=0.01, size=ON_SPHERE.shape)
    _, radii = check(target, near)
    assert (radii > 0).mean() > 0.9
    assert radii.max() < 0.1
    inside = np.random.default_rng(4).uniform(-0.1, 0.1, size=(50, 3))  # at least 0.3 from the sphere's points
    rows_radii = [nearest(*query, np.empty(LISTED), *target) for query in inside]
    assert all(row == -1 for row, _ in rows_radii)


@pytest.mark.parametrize("lists", [0, 1, 7])
@pytest.mark.parametrize("cloud", ["surface", "two clusters", "duplicates", "line"])
def test_without_room_for_further_lists_neighbors_are_still_the_true_ones(monkeypatch, cloud, lists):
    monkeypatch.setattr(batched_icp, "MOST_LISTS", lists)
    target = make_target(CLOUDS[cloud], 0.1)
    for _ in range(2):  # the second time every voxel that may have a list has it
        check(target, queries(CLOUDS[cloud], 0.1))
        assert target.used[0] == len(target.listed) == lists


def test_what_earlier_searches_left_behind_does_not_change_later_ones():
    points = CLOUDS["surface"]
    found_at = queries(points, 0.1)
    room, used, fresh = np.empty(LISTED), make_target(points, 0.1), make_target(points, 0.1)
    first = [nearest(*query, room, *used) for query in found_at]
    again = [nearest(*query, room, *used) for query in found_at]
    backwards = [nearest(*query, room, *fresh) for query in found_at[::-1]][::-1]
    assert first == again == backwards


def test_the_targets_points_are_the_given_ones_in_another_order():
    for points in CLOUDS.values():
        before = points.copy()
        target = make_target(points, 0.1)
        assert np.array_equal(points, before)
        order = np.lexsort(points.T)
        assert np.array_equal(target.points[np.lexsort(target.points.T)], points[order])
        assert target.starts[0] == 0 and target.starts[-1] == len(points)
