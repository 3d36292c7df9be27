import numpy as np
import pytest
from scipy.spatial import cKDTree

from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.rigid import exp
from gpca.pairs.perturbation import CONCEPTS, PERTURBATIONS, Severities
from gpca.uncertainty import interventions
from gpca.uncertainty.interventions import (
    FEWEST_TRIMMED,
    RESTARTS,
    Remedies,
    RemedyRuns,
    best_of_neighbors,
    denoise,
    trim,
)
from gpca.uncertainty.settings import CORNERS, UncertaintySettings
from gpca.uncertainty.spread import Runs

SETTINGS = UncertaintySettings(starts=13, icp_points=100)


def sphere(n, seed=0, radius=0.5):
    points = np.random.default_rng(seed).normal(size=(n, 3))
    return radius * points / np.linalg.norm(points, axis=1, keepdims=True)


def plane(n, seed=0):
    return np.random.default_rng(seed).uniform(-0.5, 0.5, size=(n, 3)) * [1, 1, 0]


# Denoising


def test_noise_on_a_plane_is_taken_away():
    noisy = plane(300) + np.random.default_rng(1).normal(scale=0.02, size=(300, 3))
    smooth = denoise(noisy)
    assert smooth[:, 2].std() < 0.5 * noisy[:, 2].std()
    assert len(smooth) > 250
    tilt = np.array([[0.6, 0, 0.8], [0, 1, 0], [-0.8, 0, 0.6]])
    assert np.allclose(denoise(noisy @ tilt.T + 3), smooth @ tilt.T + 3, atol=1e-9)


def test_noise_on_a_sphere_is_lowered():
    noisy = sphere(1000) + np.random.default_rng(1).normal(scale=0.02, size=(1000, 3))
    off = [np.sqrt(np.mean((np.linalg.norm(points, axis=1) - 0.5) ** 2)) for points in (noisy, denoise(noisy))]
    assert off[1] < 0.6 * off[0]


def test_far_outliers_are_removed_and_no_others():
    clean = plane(200)
    outliers = np.array([[0.0, 0.0, 2.0], [3.0, 0.0, 0.0], [-2.0, -2.0, 1.0]])
    smooth = denoise(np.concatenate([clean[:100], outliers, clean[100:]]))
    assert len(smooth) == 200
    # The planes that hardly an outlier belongs to are the plane itself.
    assert np.abs(smooth).max() < 0.51 and np.abs(smooth[:, 2]).max() < 1e-9


def test_points_of_a_plane_stay_where_they_are_and_the_given_ones_are_not_changed():
    clean = plane(200)
    before = clean.copy()
    smooth = denoise(clean)
    assert np.array_equal(clean, before)
    assert len(smooth) > 180
    assert cKDTree(clean).query(smooth)[0].max() < 1e-12


@pytest.mark.parametrize("points", [plane(3), plane(10), np.tile(plane(1), (40, 1)), plane(50) * [1, 0, 0]])
def test_few_identical_and_collinear_points_are_survived(points):
    smooth = denoise(points)
    assert len(smooth) >= min(3, len(points)) and np.isfinite(smooth).all()
    assert cKDTree(points).query(smooth)[0].max() < 1e-9


# Trimming


def test_the_target_is_trimmed_to_what_the_source_covers():
    target, source = sphere(300, 0), sphere(300, 1)
    half = source[source[:, 0] < 0]
    kept = trim(target, half, 0.1)
    covered = np.linalg.norm(target[:, None] - half[None], axis=2).min(axis=1) < 0.1
    assert np.array_equal(kept, target[covered])
    assert 0.4 < covered.mean() < 0.65
    assert np.array_equal(trim(target, target, 0.1), target)


@pytest.mark.parametrize("covered", [0, 1, FEWEST_TRIMMED - 1, FEWEST_TRIMMED])
def test_with_hardly_any_overlap_nothing_is_trimmed(covered):
    target = plane(200)
    source = np.concatenate([target[:covered], target + np.array([0, 0, 20.0])])
    kept = trim(target, source, 1e-6)
    assert len(kept) == (covered if covered >= FEWEST_TRIMMED else 200)


# Restarting


def runs(cost):
    """Runs in which every point has a correspondence, so that the cost is the squared RMSE."""
    n = len(cost)
    poses_n = np.tile(np.eye(4), (n, 1, 1))
    poses_n[:, 0, 3] = np.arange(n)
    return Runs(poses_n, np.ones(n), np.sqrt(cost), n, 0.0)


def test_every_run_becomes_the_best_of_itself_and_the_next_ones():
    cost = np.random.default_rng(0).uniform(size=20)
    best = best_of_neighbors(runs(cost), 0.1)
    windows = [[(i + k) % 20 for k in range(RESTARTS)] for i in range(20)]
    expected = [min(window, key=lambda row: cost[row]) for window in windows]
    assert best.T_target_source_n[:, 0, 3].tolist() == expected
    assert np.allclose(best.cost_n(0.1), [min(cost[window]) for window in windows])
    assert len(set(expected)) > 1
    assert best.icp_calls == 20


def test_a_run_of_few_close_points_is_not_the_best():
    made = Runs(
        runs(np.zeros(13)).T_target_source_n, np.where(np.arange(13) == 5, 0.1, 0.9), np.full(13, 0.02), 13, 0.0
    )
    made.inlier_rmse_n[5] = 0.001
    assert 5 not in best_of_neighbors(made, 0.1).T_target_source_n[:, 0, 3]


def test_equally_good_runs_are_left_as_they_are():
    assert best_of_neighbors(runs(np.ones(13)), 0.1).T_target_source_n[:, 0, 3].tolist() == list(range(13))


# All together


def pebble(n, random):
    """Points of a smooth body without symmetry, one diagonal long."""
    x, y, z = directions = random.normal(size=(3, n))
    x, y, z = directions = directions / np.linalg.norm(directions, axis=0)
    radius = 0.35 + 0.1 * x * np.abs(x) + 0.08 * y - 0.06 * z * x + 0.1 * np.maximum(z, 0) ** 3
    points = (directions * radius).T * [1, 0.75, 0.55]
    return points / np.linalg.norm(np.ptp(points, axis=0))


STRONG = Severities(noise=(0.03, 0.03), rotation_deg=(60, 60), translation=(0.3, 0.3), crop=(0.6, 0.6))


def remedy_runs(concept, number, points):
    random = np.random.default_rng((CONCEPTS.index(concept), number))
    clean = pebble(2 * points, random)
    source, target = PERTURBATIONS[concept](clean[:points], STRONG, random).points, clean[points:]
    T_icp = BatchedICP(target, SETTINGS.icp).register(source, np.eye(4)[None])[0][0]
    xi_n_6 = random.normal(size=(13, 6)) * SETTINGS.deviation_6()
    return RemedyRuns(source, target, np.eye(4), T_icp, xi_n_6, SETTINGS, random)


@pytest.mark.parametrize(
    ("concept", "pairs", "points"), [("noise", 20, 4000), ("pose", 40, 1000), ("overlap", 16, 600)]
)
def test_on_average_the_matching_remedy_lowers_the_residual_most(concept, pairs, points):
    """For strong causes and a smooth body; of sparse points denoising takes away more of the body than of the noise."""
    changes = []
    for number in range(pairs):
        evaluate = remedy_runs(concept, number, points)
        observed = evaluate(Remedies()).residual
        changes.append([evaluate(Remedies(*row)).residual - observed for row in np.eye(3, dtype=bool)])
    mean = np.mean(changes, axis=0)
    assert mean.argmin() == CONCEPTS.index(concept)
    assert mean.min() < -0.01


def test_a_combination_does_not_depend_on_those_before_it():
    forth, back = remedy_runs("overlap", 0, 300), remedy_runs("overlap", 0, 300)
    one = [forth(Remedies(*switches)) for switches in CORNERS]
    other = [back(Remedies(*switches)) for switches in CORNERS[::-1]][::-1]
    numbers = [[(each.covariance.tobytes(), each.residual) for each in outcomes] for outcomes in (one, other)]
    assert numbers[0] == numbers[1]
    assert len(set(numbers[0])) == len(CORNERS)
    assert [each.icp_calls for each in one] == [13] * len(CORNERS)
    assert all(each.seconds > each.icp_seconds > 0 for each in one)


def test_what_several_combinations_share_is_worked_out_by_the_first_that_needs_it(monkeypatch):
    worked_out = []
    for name in ("denoise", "trim"):
        work = getattr(interventions, name)
        monkeypatch.setattr(interventions, name, lambda *given, n=name, w=work: worked_out.append(n) or w(*given))
    evaluate = remedy_runs("noise", 0, 300)
    evaluate(Remedies())
    evaluate(Remedies(restart=True))
    assert worked_out == []
    for _ in range(2):
        evaluate(Remedies(denoise=True))
        evaluate(Remedies(denoise=True, trim=True))
        assert worked_out == ["denoise", "trim"]


def test_no_overlap_at_all_gives_finite_flagged_outcomes():
    xi_n_6 = np.random.default_rng(0).normal(size=(13, 6)) * SETTINGS.deviation_6()
    far = sphere(200, 1) + np.array([50.0, 0.0, 0.0])
    evaluate = RemedyRuns(sphere(200), far, np.eye(4), np.eye(4), xi_n_6, SETTINGS, np.random.default_rng(0))
    for switches in CORNERS:
        outcome = evaluate(Remedies(*switches))
        assert outcome.degenerate and np.isfinite(outcome.covariance).all() and np.isfinite(outcome.residual)


def test_the_same_points_as_source_and_target_give_finite_outcomes():
    xi_n_6 = np.random.default_rng(0).normal(size=(13, 6)) * SETTINGS.deviation_6()
    points = pebble(100, np.random.default_rng(0))
    evaluate = RemedyRuns(points, points, np.eye(4), np.eye(4), 0.05 * xi_n_6, SETTINGS, np.random.default_rng(0))
    outcomes = [evaluate(Remedies(*switches)) for switches in CORNERS]
    assert outcomes[0].residual == pytest.approx(np.log(1e-6)) and outcomes[0].degenerate
    assert all(np.isfinite(each.residual) and np.isfinite(each.covariance).all() for each in outcomes)


def test_what_is_given_is_not_changed():
    source, target = sphere(200), sphere(200, 1)
    xi_n_6, T = np.full((13, 6), 0.01), exp(np.full((1, 6), 0.05))[0]
    given = (source, target, T, T.copy(), xi_n_6)
    before = [array.copy() for array in given]
    evaluate = RemedyRuns(*given, SETTINGS, np.random.default_rng(0))
    for switches in CORNERS:
        evaluate(Remedies(*switches))
    assert all(np.array_equal(array, expected) for array, expected in zip(given, before, strict=True))
