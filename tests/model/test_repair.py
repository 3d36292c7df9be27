"""A pose is replaced only where another is called good; where several are right alike, all are given."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.alignment.icp import ICPSettings
from gpca.causes.settings import MODEL, OBSERVED
from gpca.guarantee.guarantee import calibrate
from gpca.model.repair import (
    GOOD,
    NOT_REPAIRED,
    REPAIRED,
    SEVERAL,
    Proposals,
    by_method,
    by_mixture,
    decide,
    difference,
    inliers,
    measured,
    propose,
    unseen,
)
from gpca.model.result import Calibrated, Evidence, ResultJudge, level_at
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import inverse, transform

JUDGE, LEVEL = ResultJudge.untrained(), Calibrated(0.03, 0.4)


def proposals(weight_K, distance_n_K, fitness=0.9):
    """Hypotheses (K,) and the errors of n poses under each: the registered one, and the K themselves."""
    n = len(distance_n_K)
    evidence = Evidence(
        np.array(distance_n_K, float), np.tile(weight_K, (n, 1)), np.full(n, 0.01), np.full(n, float(fitness))
    )
    return Proposals(np.tile(np.eye(4), (n, 1, 1)), np.array([0.0, *weight_K]), evidence)


@pytest.mark.parametrize(
    ("weight_K", "registered", "verdict", "row", "rows"),
    [
        ([0.9, 0.1], [0.001, 0.2], GOOD, 0, ()),
        ([0.9, 0.1], [0.2, 0.001], REPAIRED, 1, ()),
        ([0.1, 0.9], [0.001, 0.2], REPAIRED, 2, ()),
        ([0.5, 0.5], [0.2, 0.2], SEVERAL, 0, (1, 2)),
        ([0.97, 0.03], [0.2, 0.2], NOT_REPAIRED, 0, ()),
    ],
)
def test_the_verdict_follows_the_judge(weight_K, registered, verdict, row, rows):
    given = proposals(weight_K, [registered, [0.001, 0.2], [0.2, 0.001]])
    # A cautious threshold for what is called repaired leaves the last pair, and no other, without a verdict.
    level = Calibrated(0.03, 0.5, repaired_below=0.02) if verdict == NOT_REPAIRED else LEVEL
    said = decide(JUDGE, level, given, 0.03)
    assert (said.name, said.row, said.rows) == (verdict, row, rows)
    assert said.probability_n[said.row] == min(said.probability_n) or verdict in (SEVERAL, NOT_REPAIRED)


def test_a_pose_that_is_called_good_stays_even_where_another_is_likelier():
    given = proposals([0.6, 0.4], [[0.2, 0.001], [0.001, 0.2], [0.2, 0.001]])
    assert decide(JUDGE, Calibrated(0.03, 0.7), given, 0.03).name == GOOD
    assert decide(JUDGE, Calibrated(0.03, 0.5), given, 0.03).name == REPAIRED


def test_the_alarm_and_the_promise_about_repairs_are_stricter_than_the_threshold():
    state_N = np.where(np.arange(400) % 2, "nominal", "pose")
    nominal_N = np.where(state_N == "nominal", 0.9, np.linspace(0, 0.8, 400))
    guarantee = calibrate(np.column_stack([nominal_N, 1 - nominal_N, *[0 * nominal_N] * 3]), state_N)
    level = Calibrated(0.03, 0.5, guarantee)
    assert level.good_below == min(guarantee.failure_alarm.good_below, 0.5) < 0.5
    stricter = Calibrated(0.03, 0.5, guarantee, 0.01)
    assert stricter.good_below == 0.01
    assert Calibrated.from_state(stricter.state()) == stricter
    old = {name: value for name, value in level.state().items() if name != "repaired_below"}
    assert Calibrated.from_state(old).repaired_below is None
    between = level_at([stricter, Calibrated(0.05, 0.4, guarantee, 0.02)], 0.04)
    assert between.repaired_below == 0.01
    assert level_at([level, stricter], 0.03).repaired_below is None


@pytest.fixture(scope="module")
def mug():
    """The points of a cylinder along z with a handle at +x, whose diameter is about 1."""
    random = np.random.default_rng(1)
    turn, height = random.uniform(0, 2 * np.pi, 412), random.uniform(-0.4, 0.4, 412)
    body = np.column_stack([0.25 * np.cos(turn), 0.25 * np.sin(turn), height])
    around = random.uniform(-np.pi / 2, np.pi / 2, 100)
    handle = np.column_stack([0.25 + 0.3 * np.cos(around), random.normal(0, 0.02, 100), 0.2 * np.sin(around)])
    return ModelSurface(random.permutation(np.concatenate([body, handle])))


def turned(degrees, x=0.0):
    angle, T = np.deg2rad(degrees), np.eye(4)
    T[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    T[0, 3] = x
    return T


@pytest.mark.parametrize(("moved", "by"), [(OBSERVED, None), (MODEL, "point_to_point")])
def test_hypotheses_are_refined_without_outliers_and_each_is_proposed_once(mug, moved, by):
    random, icp, T_true = np.random.default_rng(2), ICPSettings(), turned(40, 0.1)
    cloud = mug.points + random.normal(0, 0.005, mug.points.shape)
    outliers = random.uniform(-0.5, 0.5, (40, 3))
    observed = transform(inverse(T_true), np.concatenate([cloud, outliers]))
    T_K = np.array([turned(220, 0.1), turned(38, 0.11), turned(43, 0.1), np.eye(4)])
    weight_K = np.array([0.3, 0.4, 0.3, 0.0])
    refine = by_mixture(mug.points, mug.spacing) if by is None else by_method(mug.points, mug, by, 0)
    found = propose(observed, mug, turned(0), T_K, weight_K, refine, measured(observed, mug.points, icp, moved))
    assert len(found.T_n) == 3  # the registered one, the right one, and the mug from behind
    np.testing.assert_allclose(found.weight_n, [0, 0.7, 0.3])
    errors_n = mug.errors(found.T_n @ inverse(T_true))
    assert errors_n[1] < 0.01 < errors_n[2]
    from_K = [T @ np.array([inverse(T) for T in T_K]) for T in found.T_n]
    np.testing.assert_allclose(found.evidence.distance_N_K[:, :4], [mug.errors(T_K) for T_K in from_K])
    stricter, _ = replace(found.true_poses, up_to_symmetry=True).errors(found.T_n)
    np.testing.assert_allclose(stricter[:, :4], [mug.errors_up_to_symmetry(T_K) for T_K in from_K])
    np.testing.assert_array_equal(stricter[:, 4], found.true_poses.errors(found.T_n)[0][:, 4])
    # ICP from many starts ends at the right pose, and has no say on the registered one.
    np.testing.assert_allclose(found.evidence.weight_N_K[:2], [[*weight_K, 0], [*weight_K / 2, 0.5]])
    assert found.evidence.distance_N_K[1, 4] < 0.02 < found.evidence.distance_N_K[2, 4]
    assert found.evidence.fitness_N[1] > found.evidence.fitness_N[0]


def test_the_handle_tells_two_poses_of_a_mug_apart(mug):
    part, distance = difference(mug, turned(0), turned(180))
    assert part.direction[0] > 0.95
    assert 0.02 < part.share < 0.2
    assert 0.1 < distance < 0.3


def test_points_on_surface_that_the_target_lacks_are_no_outliers_but_are_not_registered(mug):
    lower = ModelSurface(mug.points[mug.points[:, 2] < 0.15])
    outliers, missing = unseen(mug.points, lower, turned(0))
    assert outliers < 0.05 and missing is None
    [inlier_N] = inliers(mug.points, lower, turned(0)[None])
    assert (inlier_N == (mug.points[:, 2] < 0.2)).mean() > 0.9


def test_the_likelihood_is_not_misled_by_surface_that_the_target_lacks(mug):
    half = ModelSurface(mug.points[mug.points[:, 0] < 0])
    noisy = mug.points + np.random.default_rng(3).normal(0, 0.05, mug.points.shape)
    [T] = by_mixture(half.points, half.spacing)(noisy, turned(4, 0.02)[None])
    assert mug.errors(T[None])[0] < 0.025
