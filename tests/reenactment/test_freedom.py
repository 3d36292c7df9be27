"""Directions in which a pose is free are named, others are not."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from benchmarks import undetermined as shapes
from gpca.model.undetermined import OUT_OF_PLANE, Undetermined
from gpca.objects.canonical import CanonicalFrame
from gpca.reenactment.freedom import Holder
from gpca.rigid import exp, transform

FREE = {
    "plane": "slide across the target's z axis and to turn about the target's z axis",
    "corridor": "slide along the target's y axis",
    "shaft": "slide along the target's z axis and to turn about the target's z axis",
    "box": None,
    "sphere": "turn about any axis",
    "vase": "turn about the target's z axis",
    "handled": None,
    "flat_room": None,
    "flat_corridor": "slide along the target's x axis",
}


def freedom_of(name, noise=0.005, open_ends=False, T=None):
    random = np.random.default_rng(100)
    shape = getattr(shapes, name)
    larger = {"larger": shapes.LARGER} if name in shapes.OPEN_ENDED else {}
    points, target = shape(512, random)[0], shape(820, random, **larger)[0]
    in_plane = [1, 1, 0] if name.startswith("flat") else [1, 1, 1]
    points = points + noise * random.normal(size=points.shape) * in_plane
    if T is not None:
        points, target = transform(T, points), transform(T, target)
    return Holder(target, cKDTree(target), open_ends).freedom(points)


@pytest.mark.parametrize("open_ends", [False, True])
@pytest.mark.parametrize("name", FREE)
def test_free_directions_and_no_others_are_named(name, open_ends):
    words = Undetermined.of(freedom_of(name, open_ends=open_ends)).words
    expected = [f"the pose is free to {FREE[name]}"] if FREE[name] else []
    assert words == "; ".join(expected + ([OUT_OF_PLANE] if name.startswith("flat") else []))


def test_outlines_in_any_plane_are_not_measured_out_of_it():
    freedom = freedom_of("flat_room", T=exp(np.array([[0.3, -0.8, 0.5, 0.4, -0.2, 0.1]]))[0])
    assert Undetermined.of(freedom).words == OUT_OF_PLANE
    np.testing.assert_allclose(np.sort(freedom.deviation_6)[3:], 0.5)
    assert np.sort(freedom.deviation_6)[2] < 0.01


def test_an_axis_lies_where_the_shape_turns_about_it_and_the_covariance_is_large_along_it_alone():
    T = exp(np.array([[0.3, -0.8, 0.5, 0.4, -0.2, 0.1]]))[0]
    freedom = freedom_of("vase", T=T)
    frame = CanonicalFrame(np.array([5.0, 6.0, 7.0]), 200.0)
    undetermined = Undetermined.of(freedom).outside(frame)
    (turn,) = undetermined.directions
    axis = T[:3, 2] * np.sign(T[:3, 2] @ turn.axis)
    np.testing.assert_allclose(turn.axis, axis, atol=0.03)
    off_axis = np.array(turn.through) - frame.center_3 - 200 * T[:3, 3]
    assert np.linalg.norm(np.cross(off_axis, axis)) < 4
    assert turn.deviation > 60
    assert np.sqrt(axis @ undetermined.covariance[:3, :3] @ axis) > 1
    for direction in (T[:3, 0], T[:3, 1]):
        assert np.sqrt(direction @ undetermined.covariance[:3, :3] @ direction) < np.deg2rad(8)
        assert np.sqrt(direction @ undetermined.covariance[3:, 3:] @ direction) < 8
