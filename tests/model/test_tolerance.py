import numpy as np
import pytest

from gpca.alignment.pose_error import PoseErrors
from gpca.errors import InputError
from gpca.model.result import Tolerance
from gpca.rigid import exp

BALL = np.random.default_rng(0).normal(size=(4000, 3))
BALL *= 0.5 / np.linalg.norm(BALL, axis=1, keepdims=True)  # of diameter one


@pytest.mark.parametrize(
    ("text", "length_mm"), [("5mm", 5), ("5 mm", 5), ("0.4cm", 4), ("0.01m", 10), ("3%", 6), ("2.5 %", 5)]
)
def test_lengths_and_shares_are_lengths_in_the_unit_of_the_points(text, length_mm):
    assert Tolerance.parse(text).length(BALL, 200.0, "mm") == pytest.approx(length_mm)
    assert Tolerance.parse(text).length(BALL, 0.2, "m") == pytest.approx(length_mm / 1e3)


def test_an_angle_is_the_mean_error_of_poses_that_are_turned_by_it():
    errors = PoseErrors(BALL, len(BALL), symmetric=False)
    axes = np.random.default_rng(1).normal(size=(50, 3))
    turns = np.deg2rad(20) * axes / np.linalg.norm(axes, axis=1, keepdims=True)
    expected = errors(exp(np.hstack([turns, np.zeros_like(turns)]))).mean()
    assert Tolerance.parse("20deg").length(BALL, 1.0, "m") == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("text", ["", "5", "mm", "-1mm", "0%", "nan%", "5 km", "five mm", "infmm", "5mm2"])
def test_what_is_no_tolerance_is_refused_with_examples(text):
    with pytest.raises(InputError, match="such as 5mm, 2deg or 3%"):
        Tolerance.parse(text)


@pytest.mark.parametrize("text", ["200mm", "60%", "1m"])
def test_a_tolerance_of_more_than_half_the_target_is_refused(text):
    with pytest.raises(InputError, match="diameters of the target; give at most half of the diameter, 200 mm"):
        Tolerance.parse(text).length(BALL, 200.0, "mm")
