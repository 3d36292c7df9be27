import numpy as np
import pytest

from gpca.errors import InputError
from gpca.objects import canonical_frame
from gpca.objects.canonical_frame import CanonicalFrame, thin
from gpca.rigid import exp, transform

BOX = np.random.default_rng(0).uniform((0, 0, 0), (0.3, 0.4, 1.2), size=(500, 3))
BOX[:2] = (0, 0, 0), (0.3, 0.4, 1.2)


def test_origin_and_unit_are_those_of_the_training():
    frame = CanonicalFrame.of(BOX + 5)
    np.testing.assert_allclose(frame.center_3, 5 + np.array([0.15, 0.2, 0.6]))
    assert frame.diameter == pytest.approx(1.3)
    inside = frame.coordinates(BOX + 5)
    np.testing.assert_allclose(inside.min(axis=0), -inside.max(axis=0))
    assert np.linalg.norm(inside[0] - inside[1]) == pytest.approx(1)


def test_a_pose_outside_moves_points_as_it_does_inside():
    frame, T = CanonicalFrame(np.array([1.0, -2.0, 0.5]), 0.2), exp(np.array([[0.3, -0.2, 0.9, 0.1, 0.2, -0.4]]))[0]
    np.testing.assert_allclose(
        frame.coordinates(transform(frame.pose_outside(T), BOX)), transform(T, frame.coordinates(BOX))
    )


@pytest.mark.parametrize(
    ("points", "unit", "message"),
    [
        (BOX[:10], "m", "target: has 10 points; give 64 or more"),
        (np.where(np.arange(500)[:, None] == 7, np.nan, BOX), "m", "target: 1 of 500 points contain NaN"),
        (BOX * [1, 0, 0], "m", "all its points coincide or lie on one line"),
        (BOX * 1000, "m", "diameter is 1300 m, .*unit: mm"),
        (BOX * 1e-3, "mm", "diameter is 1.3e-06 m, .*unit: m"),
        (BOX, "inch", "unit 'inch'"),
    ],
)
def test_points_that_span_no_frame(points, unit, message):
    with pytest.raises(InputError, match=message):
        CanonicalFrame.of(points, unit)


def test_a_huge_cloud_is_measured_by_some_of_its_points(monkeypatch):
    monkeypatch.setattr(canonical_frame, "MEASURED_POINTS", 1000)
    sphere = np.random.default_rng(1).normal(size=(100_000, 3))
    sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    assert CanonicalFrame.of(sphere).diameter == pytest.approx(2, rel=5e-3)


def test_thinning_draws_points_once_each_and_the_same_every_time():
    few = thin(BOX, 100, "a")
    assert len(np.unique(few, axis=0)) == 100
    np.testing.assert_array_equal(few, thin(BOX, 100, "a"))
    assert not np.array_equal(few, thin(BOX, 100, "b"))
    assert thin(BOX, 500, "a") is BOX
