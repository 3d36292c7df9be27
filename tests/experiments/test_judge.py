import numpy as np
import pytest

from gpca.pairs.judge import Judge
from gpca.rigid import exp


def motion(*twist):
    return exp(np.array([twist], float))[0]


TRUE = motion(0.4, -0.2, 0.9, 0.3, 0.1, -0.2)  # of the source; no error depends on it


@pytest.fixture(scope="module")
def brick(objects):
    return Judge(objects, 0)


def test_errors_are_in_diameters_and_radians_up_to_symmetry(brick):
    errors = brick(TRUE, TRUE)
    assert errors.keys() == {"add_relative", "rotation_error_rad", "translation_error"}
    assert max(errors.values()) < 1e-6
    errors = brick(motion(0, 0, 0, 0.01, 0, 0) @ TRUE, TRUE)
    assert errors["translation_error"] == pytest.approx(0.01)
    assert errors["rotation_error_rad"] == pytest.approx(0, abs=1e-6)
    assert 0 < errors["add_relative"] < 0.01  # to the nearest point of a symmetric object
    assert brick.symmetric
    errors = brick(motion(0, 0, np.pi, 0, 0, 0) @ TRUE, TRUE)
    assert errors["rotation_error_rad"] == pytest.approx(0, abs=1e-6)
    assert errors["add_relative"] < 0.03  # as near as the test object's 600 points lie
    quarter = brick(motion(0, 0, np.pi / 2, 0, 0, 0) @ TRUE, TRUE)
    assert quarter["rotation_error_rad"] == pytest.approx(np.pi / 2)


def test_an_object_without_symmetries_is_judged_by_its_own_points(objects, monkeypatch):
    monkeypatch.setattr("gpca.pairs.judge.find_symmetries", lambda points, diameter: {})
    judge = Judge(objects, 0)
    assert not judge.symmetric
    shifted = judge(motion(0, 0, 0, 0, 0.02, 0) @ TRUE, TRUE)
    assert shifted["add_relative"] == pytest.approx(0.02)
    assert judge(motion(0, 0, np.pi, 0, 0, 0) @ TRUE, TRUE)["rotation_error_rad"] == pytest.approx(np.pi)
