from time import perf_counter

import numpy as np
import pytest
from scipy.spatial import cKDTree

from gpca.alignment.batched_icp import BatchedICP
from gpca.rigid import exp, inverse, transform
from gpca.uncertainty.spread import (
    SMALLEST_RESIDUAL,
    Runs,
    UncertaintySettings,
    divergence,
    log_determinant,
    run_from_starts,
    summarize_runs,
)

SETTINGS = UncertaintySettings(starts=13)
FLOORS = 10.0 ** np.arange(-9, -1)
RANDOM = np.random.default_rng(0)
ON_ELLIPSOID = RANDOM.normal(size=(200, 3))
ON_ELLIPSOID *= [0.5, 0.35, 0.2] / np.linalg.norm(ON_ELLIPSOID, axis=1, keepdims=True)


def covariance(seed, scale=1e-3, rank=6):
    factor = np.random.default_rng(seed).normal(size=(6, rank))
    return scale * factor @ factor.T


def runs(poses_n, fitness=1.0, rmse=0.0):
    n = len(poses_n)
    return Runs(poses_n, np.broadcast_to(fitness, n).astype(float), np.broadcast_to(rmse, n).astype(float), n, 0.0)


def twists(n=13, seed=0, scale=1.0):
    return np.random.default_rng(seed).normal(size=(n, 6)) * SETTINGS.deviation_6() * scale


def test_equal_covariances_do_not_diverge_and_of_diagonal_ones_it_is_the_sum_over_the_axes():
    for seed in range(20):
        assert divergence(covariance(seed), covariance(seed), 1e-6) == pytest.approx(0, abs=1e-9)
    for nothing in (np.zeros((6, 6)), covariance(0, rank=2)):
        assert divergence(nothing, nothing, 1e-6) == pytest.approx(0, abs=1e-9)
    clean, other = np.array([1, 2, 3, 4, 5, 6.0]), np.array([2, 2, 1, 8, 5, 3.0])
    by_hand = 0.5 * sum(c / o - 1 - np.log(c / o) for c, o in zip(clean + 0.5, other + 0.5, strict=True))
    assert divergence(np.diag(clean), np.diag(other), 0.5) == pytest.approx(by_hand, rel=1e-12)
    assert by_hand > 0.1
    # Of a block of the pose, such as the rotation, as well.
    assert divergence(np.diag([1.0, 2]), np.diag([2.0, 2]), 0.0) == pytest.approx(0.5 * (0.5 - 1 + np.log(2)))
    assert divergence(np.zeros((3, 3)), np.zeros((3, 3)), 1e-6) == 0


def test_it_is_the_mean_log_ratio_of_the_densities():
    """The definition itself, by drawing from the clean distribution."""
    from scipy.stats import multivariate_normal

    clean, other, floor = covariance(0), covariance(1), 1e-3
    clean_density, other_density = (
        multivariate_normal(np.zeros(6), each + floor * np.eye(6)) for each in (clean, other)
    )
    drawn = clean_density.rvs(40_000, random_state=0)
    log_ratio = clean_density.logpdf(drawn) - other_density.logpdf(drawn)
    error = 4 * log_ratio.std() / np.sqrt(len(drawn))
    assert divergence(clean, other, floor) == pytest.approx(log_ratio.mean(), abs=error)


def test_many_pairs_at_once_are_each_pair_by_itself():
    clean, others = covariance(0), np.stack([[covariance(10 * i + j) for j in range(4)] for i in range(3)])
    together = divergence(clean, others, 1e-6)
    assert together.shape == (3, 4)
    for i in range(3):
        assert divergence(clean, others[i, 2], 1e-6) == pytest.approx(together[i, 2], rel=1e-12)
    paired = divergence(others[:, :1], others, 1e-6)
    assert paired[:, 0] == pytest.approx(0, abs=1e-9) and (paired[:, 1:] > 1e-3).all()


@pytest.mark.parametrize("clean_rank", [0, 1, 6])
@pytest.mark.parametrize("other_rank", [0, 3, 6])
def test_it_is_finite_for_singular_covariances_at_every_floor_and_falls_with_the_floor(clean_rank, other_rank):
    # Adding εI to both is adding the same independent noise to both distributions, and that never increases the
    # divergence (data processing inequality): u falls with ε for every pair, whether or not the two commute.
    clean, other = covariance(1, 1e-4, clean_rank), covariance(2, 1e-3, other_rank)
    swept = np.array([divergence(clean, other, floor) for floor in FLOORS])
    assert np.isfinite(swept).all() and (swept >= 0).all()
    assert (np.diff(swept) <= 1e-9 * (1 + swept[:-1])).all()
    if clean_rank or other_rank:
        assert swept[-1] < 0.5 * swept[0]
    assert np.isfinite(log_determinant(other, FLOORS[0]))


def test_the_log_determinant_is_that_of_the_floored_covariance():
    variances = np.array([1, 2, 3, 4, 5, 0.0])
    assert log_determinant(np.diag(variances), 0.1) == pytest.approx(np.log(variances + 0.1).sum())
    assert log_determinant(np.zeros((6, 6)), 1e-6) == pytest.approx(6 * np.log(1e-6))
    assert log_determinant(np.stack([covariance(0), covariance(1)]), 1e-6).shape == (2,)


def test_the_starts_have_the_root_mean_square_angle_and_length_of_the_settings():
    settings = UncertaintySettings(start_rotation_deg=20, start_translation=0.3)
    xi_n_6 = np.random.default_rng(0).normal(size=(20_000, 6)) * settings.deviation_6()
    angle, length = (np.sqrt(np.square(part).sum(axis=1).mean()) for part in (xi_n_6[:, :3], xi_n_6[:, 3:]))
    assert np.rad2deg(angle) == pytest.approx(20, rel=0.02)
    assert length == pytest.approx(0.3, rel=0.02)


@pytest.mark.parametrize("about", [np.zeros(6), np.array([0.3, -1.0, 0.5, 0.2, 0.1, -0.4])])
def test_the_covariance_is_that_of_the_twists_from_the_reference(about):
    xi_n_6 = twists(30)
    T_ref = exp(about[None])[0]
    assert np.allclose(runs(exp(xi_n_6) @ T_ref).covariance(T_ref), np.cov(xi_n_6.T), rtol=1e-9, atol=1e-15)


def test_a_spread_is_flagged_below_the_floor_only_and_one_pose_in_all_runs_is_finite():
    T_ref = exp(twists(1, scale=3.0))[0]
    same = runs(np.tile(T_ref, (13, 1, 1)))
    assert same.degenerate(SETTINGS.floor)
    assert np.allclose(same.covariance(np.eye(4)), 0, atol=1e-20)
    spread = divergence(np.zeros((6, 6)), runs(exp(twists())).covariance(np.eye(4)), SETTINGS.floor)
    for u in (divergence(same.covariance(np.eye(4)), covariance(0), SETTINGS.floor), spread):
        assert np.isfinite(u) and u > 1
    deviation = np.sqrt(SETTINGS.floor)
    unit = np.random.default_rng(0).normal(size=(50, 6))
    unit = (unit - unit.mean(axis=0)) / unit.std(axis=0)
    assert runs(exp(0.9 * deviation * unit)).degenerate(SETTINGS.floor)
    assert not runs(exp(1.1 * deviation * unit)).degenerate(SETTINGS.floor)
    one_axis = unit * [1, 0, 0, 0, 0, 0]
    assert not runs(exp(3 * deviation * one_axis)).degenerate(SETTINGS.floor)
    # Without a correspondence in any run, however wide it is.
    assert runs(exp(twists()), fitness=0.0).degenerate(SETTINGS.floor)
    assert not runs(exp(twists()), fitness=np.eye(13)[4]).degenerate(SETTINGS.floor)


def test_the_cost_is_the_mean_of_the_squares_cut_off_at_the_distance():
    distances = np.array([0.01, 0.03, 0.05, 0.2, 7.0])
    inliers = distances < 0.1
    made = runs(np.eye(4)[None], inliers.mean(), np.sqrt(np.mean(distances[inliers] ** 2)))
    assert made.cost_n(0.1) == pytest.approx([np.mean(np.minimum(distances, 0.1) ** 2)])
    assert runs(np.eye(4)[None], 0.0).cost_n(0.1) == pytest.approx([0.01])


def test_icp_runs_once_from_each_start_about_the_initial_pose():
    target, T_init = ON_ELLIPSOID[100:], exp(twists(1, seed=5))[0]
    xi_n_6 = twists()
    icp = BatchedICP(target, SETTINGS.icp)
    made = run_from_starts(icp, ON_ELLIPSOID[:100], T_init, xi_n_6)
    expected = [icp.register(ON_ELLIPSOID[:100], (start @ T_init)[None]) for start in exp(xi_n_6)]
    assert np.array_equal(made.T_target_source_n, np.concatenate([poses for poses, _, _ in expected]))
    assert np.array_equal(made.fitness_n, np.concatenate([fitness for _, fitness, _ in expected]))
    assert np.array_equal(made.inlier_rmse_n, np.concatenate([rmse for _, _, rmse in expected]))
    assert made.icp_calls == 13 and made.icp_seconds > 0


def result(made, source, target, T_ref=np.eye(4)):  # noqa: B008
    return summarize_runs(made, cKDTree(source), target, T_ref, SETTINGS, perf_counter())


def test_the_residual_is_that_of_the_run_with_the_lowest_cost():
    source, target = ON_ELLIPSOID[:100], ON_ELLIPSOID[100:]
    poses_n = exp(twists())
    # Run 7 has the lowest RMSE, but of hardly any points.
    fitness, rmse = np.full(13, 0.9), np.full(13, 0.05)
    fitness[7], rmse[7], rmse[3] = 0.1, 0.001, 0.02
    made = runs(poses_n, fitness, rmse)
    moved = transform(inverse(poses_n[3]), target)
    distances = np.linalg.norm(moved[:, None] - source[None], axis=2).min(axis=1)
    assert result(made, source, target).residual == pytest.approx(0.5 * np.log(np.mean(distances**2)), rel=1e-12)
    assert np.array_equal(result(made, source, target, poses_n[5]).covariance, made.covariance(poses_n[5]))
    assert result(made, source, target).icp_calls == 13


@pytest.mark.parametrize(
    ("away", "xi_n_6", "residual"),
    [(0.0, twists(scale=0.05), np.log(SMALLEST_RESIDUAL)), (30.0, twists(50), np.log(30))],
)
def test_a_cloud_on_itself_ends_at_one_pose_and_one_out_of_reach_leaves_the_starts_spread(away, xi_n_6, residual):
    target = ON_ELLIPSOID + np.array([away, 0.0, 0.0])
    made = run_from_starts(BatchedICP(target, SETTINGS.icp), ON_ELLIPSOID, np.eye(4), xi_n_6)
    found = result(made, ON_ELLIPSOID, target)
    assert found.degenerate
    assert (made.fitness_n == (not away)).all()
    assert np.allclose(found.covariance, np.cov(xi_n_6.T) if away else 0.0, rtol=1e-9)
    assert found.residual == pytest.approx(residual, abs=0.1 if away else 1e-6)
    assert np.isfinite(found.covariance).all()
    assert np.isfinite(divergence(found.covariance, covariance(0), SETTINGS.floor))
