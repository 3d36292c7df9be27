from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gpca.alignment.rigid import inverse
from gpca.features.motion import STARTS, describe_motion, describe_starts
from gpca.features.settings import MOTION
from tests.features.conftest import ICP


def motion(pair):
    return dict(zip(MOTION, describe_motion(pair), strict=True))


def starts(pair):
    return dict(zip(STARTS, describe_starts(pair, ICP), strict=True))


def turned(angle, shift=0.0):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec([0, 0, angle]).as_matrix()
    T[0, 3] = shift
    return T


def test_icps_own_motion_is_told(pair):
    found = motion(replace(pair, T_init=inverse(turned(0.4))))
    assert found["rotation"] == pytest.approx(0.4)
    assert found["translation"] == pytest.approx(0, abs=1e-9)
    assert found["displacement"] > 0.05
    assert motion(pair)["displacement"] == 0


def test_the_spread_is_that_of_the_runs(pair):
    angles = np.random.default_rng(0).normal(scale=0.2, size=13)
    found = motion(replace(pair, T_runs=np.array([turned(angle) for angle in angles])))
    assert found["spread_rotation"] == pytest.approx(angles.std(ddof=1))
    assert found["spread_translation"] == pytest.approx(0, abs=1e-9)
    assert found["log_determinant"] > motion(pair)["log_determinant"]


def test_a_better_result_from_another_start_is_told(pair):
    fitness_n, rmse_n = pair.fitness_n.copy(), pair.inlier_rmse_n.copy()
    runs = pair.T_runs.copy()
    runs[4], rmse_n[4] = turned(0.0, shift=0.3), 0.005
    found = starts(replace(pair, T_runs=runs, fitness_n=fitness_n, inlier_rmse_n=rmse_n))
    assert found["best_cost"] == pytest.approx(0.005**2)
    assert found["gain"] == pytest.approx(0.02**2 - 0.005**2)
    assert found["to_best"] == pytest.approx(0.3)
    assert starts(pair)["gain"] == 0
