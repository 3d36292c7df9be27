import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial import cKDTree

from gpca.alignment.batched_icp import BatchedICP
from gpca.pairs.perturbation import CONCEPTS, PERTURBATIONS, Severities
from gpca.rigid import exp
from gpca.uncertainty import interventions
from gpca.uncertainty.interventions import (
    FEWEST_TRIMMED,
    MIDDLE,
    RESTARTS,
    UNTOUCHED,
    UPPER,
    KnobRuns,
    Knobs,
    PairDraws,
    Remedies,
    RemedyRuns,
    best_of_neighbors,
    denoise,
    trim,
)
from gpca.uncertainty.settings import CORNERS, UncertaintySettings
from gpca.uncertainty.spread import Runs, run_from_starts

SETTINGS = UncertaintySettings(starts=13)
XI = np.random.default_rng(0).normal(size=(13, 6)) * SETTINGS.deviation_6()
CLOUD = np.random.default_rng(1).normal(size=(240, 3))
CLOUD *= [0.5, 0.35, 0.2] / np.linalg.norm(CLOUD, axis=1, keepdims=True)
SOURCE, TARGET = CLOUD[:120], CLOUD[120:]
T_INIT, T_REF = exp(np.array([[0.1, 0, 0, 0, 0.02, 0], [0.0, 0.1, 0, 0.01, 0, 0]]))


def knob_runs(source=SOURCE, target=TARGET, seed=0):
    return KnobRuns((source, target, T_INIT, T_REF), PairDraws(XI, SETTINGS, np.random.default_rng(seed)))


@pytest.fixture()
def calls(monkeypatch):
    """What ICP is given: source, initial pose and twists of each call."""
    seen = []

    def recorded(icp, source, T_init, xi_n_6):
        seen.append((source, T_init, xi_n_6))
        return run_from_starts(icp, source, T_init, xi_n_6)

    monkeypatch.setattr(interventions, "run_from_starts", recorded)
    return seen


def numbers(outcome):
    return outcome.covariance.tobytes(), outcome.residual, outcome.degenerate


def test_a_setting_is_evaluated_once(calls):
    runs = knob_runs()
    first = runs(MIDDLE)
    assert first.icp_calls == 13 and 0 < first.icp_seconds < first.seconds
    for again in (runs(MIDDLE), runs(Knobs(*np.array(MIDDLE)))):
        assert numbers(again) == numbers(first)
        assert again.icp_calls == 0 and again.icp_seconds == 0 and again.seconds == 0
    assert len(calls) == 1
    assert runs(UNTOUCHED).icp_calls == 13 and len(calls) == 2
    # What has been seen is known to the pair's own function only.
    assert knob_runs()(MIDDLE).icp_calls == 13 and len(calls) == 3


def test_a_setting_does_not_depend_on_those_before_it():
    settings = [UNTOUCHED, MIDDLE, UPPER, Knobs(0.01), Knobs(spread=3.0), Knobs(overlap=0.3)]
    runs, backwards = knob_runs(), knob_runs()
    forth, back = [runs(each) for each in settings], [backwards(each) for each in settings[::-1]][::-1]
    assert [numbers(each) for each in forth] == [numbers(each) for each in back]
    assert len({numbers(each) for each in forth}) == len(settings)


def test_middle_and_upper_ends_are_those_of_the_severities():
    ranges = Severities()
    rotation_over_starts = np.array(ranges.rotation_deg) / SETTINGS.start_rotation_deg
    translation_over_starts = np.array(ranges.translation) / SETTINGS.start_translation
    assert (UPPER.noise, UPPER.overlap) == (ranges.noise[1], ranges.crop[1])
    assert [rotation_over_starts[1], translation_over_starts[1]] == pytest.approx([UPPER.spread] * 2)
    assert (MIDDLE.noise, MIDDLE.overlap) == pytest.approx((np.mean(ranges.noise), np.mean(ranges.crop)))
    assert MIDDLE.spread == pytest.approx(rotation_over_starts.mean())
    assert (np.diff([(0, 1, 0), MIDDLE, UPPER], axis=0) > 0).all()


def test_spread_scales_the_starts_and_noise_is_the_same_jitter_times_its_deviation(calls):
    runs = knob_runs()
    for spread in (0.5, 6.0):
        runs(Knobs(spread=spread))
    assert np.array_equal(calls[0][2], 0.5 * XI) and np.array_equal(calls[1][2], 6.0 * XI)
    assert all(np.array_equal(source, SOURCE) and np.array_equal(T, T_INIT) for source, T, _ in calls)
    calls.clear()
    for noise in (0.01, 0.03, 0.5):
        runs(Knobs(noise))
    jitters = [(source - SOURCE) / noise for (source, _, _), noise in zip(calls, (0.01, 0.03, 0.5), strict=True)]
    assert np.allclose(jitters[0], jitters[1]) and np.allclose(jitters[0], jitters[2])
    assert jitters[0].std(axis=0) == pytest.approx(1, abs=0.2)
    assert np.abs(jitters[0].mean(axis=0)).max() < 0.4
    assert all(np.array_equal(xi_n_6, XI) for _, _, xi_n_6 in calls)


def rows_of(points):
    return [int(np.flatnonzero((point == SOURCE).all(axis=1))[0]) for point in points]


def test_overlap_cuts_off_that_share_beyond_a_plane_and_more_of_the_same_side_when_larger(calls):
    runs = knob_runs()
    shares = (0.1, 0.4, 0.6)
    for share in shares:
        runs(Knobs(overlap=share))
    kept = [rows_of(source) for source, _, _ in calls]
    for rows, share in zip(kept, shares, strict=True):
        assert len(rows) == round(len(SOURCE) * (1 - share))
        assert rows == sorted(rows)
        side = np.where(np.isin(np.arange(len(SOURCE)), rows), 1.0, -1.0)
        # Some plane (a, b) has a·p + b <= -1 for the kept and >= 1 for the lost points.
        sides = side[:, None] * np.column_stack([SOURCE, np.ones(len(SOURCE))])
        assert linprog(np.zeros(4), A_ub=sides, b_ub=-np.ones(len(SOURCE)), bounds=(None, None)).status == 0
    assert set(kept[2]) < set(kept[1]) < set(kept[0])
    for points in (3, 4, 20):
        result = knob_runs(SOURCE[:points])(Knobs(overlap=0.95))
        assert len(calls[-1][0]) == 3
        assert np.isfinite(result.covariance).all() and np.isfinite(result.residual)


def test_all_knobs_together_are_each_of_them(calls):
    runs = knob_runs()
    for setting in (Knobs(noise=0.02), Knobs(overlap=0.4), Knobs(0.02, 3.0, 0.4)):
        runs(setting)
    (noisy, _, _), (cut, _, _), (both, _, xi_n_6) = calls
    assert np.array_equal(both, noisy[rows_of(cut)])
    assert np.array_equal(xi_n_6, 3.0 * XI)


def test_empty_overlap_and_the_same_points_are_flagged_and_finite():
    draws = PairDraws(0.05 * XI, SETTINGS, np.random.default_rng(0))
    runs = KnobRuns((TARGET, TARGET, np.eye(4), np.eye(4)), draws)
    still, noisy = runs(UNTOUCHED), runs(Knobs(0.03))
    assert still.degenerate and np.isfinite(still.covariance).all()
    assert still.residual == pytest.approx(np.log(1e-6)) and noisy.residual > still.residual
    # Whatever is left of the source lies out of reach of the target.
    for setting in (UNTOUCHED, UPPER):
        result = knob_runs(target=TARGET + np.array([50.0, 0.0, 0.0]))(setting)
        assert result.degenerate and np.isfinite(result.covariance).all() and np.isfinite(result.residual)


SETTINGS_REMEDIES = UncertaintySettings(starts=13, icp_points=100)


def sphere(n, seed=0, radius=0.5):
    points = np.random.default_rng(seed).normal(size=(n, 3))
    return radius * points / np.linalg.norm(points, axis=1, keepdims=True)


def plane(n, seed=0):
    return np.random.default_rng(seed).uniform(-0.5, 0.5, size=(n, 3)) * [1, 1, 0]


def test_noise_on_a_plane_is_taken_away_and_far_outliers_are_removed_and_no_others():
    noisy = plane(300) + np.random.default_rng(1).normal(scale=0.02, size=(300, 3))
    smooth = denoise(noisy)
    assert smooth[:, 2].std() < 0.5 * noisy[:, 2].std()
    assert len(smooth) > 250
    tilt = np.array([[0.6, 0, 0.8], [0, 1, 0], [-0.8, 0, 0.6]])
    assert np.allclose(denoise(noisy @ tilt.T + 3), smooth @ tilt.T + 3, atol=1e-9)
    clean = plane(200)
    outliers = np.array([[0.0, 0.0, 2.0], [3.0, 0.0, 0.0], [-2.0, -2.0, 1.0]])
    smooth = denoise(np.concatenate([clean[:100], outliers, clean[100:]]))
    assert len(smooth) == 200
    # The planes that hardly an outlier belongs to are the plane itself.
    assert np.abs(smooth).max() < 0.51 and np.abs(smooth[:, 2]).max() < 1e-9


@pytest.mark.parametrize("points", [plane(3), plane(10), np.tile(plane(1), (40, 1)), plane(50) * [1, 0, 0]])
def test_few_identical_and_collinear_points_are_survived(points):
    smooth = denoise(points)
    assert len(smooth) >= min(3, len(points)) and np.isfinite(smooth).all()
    assert cKDTree(points).query(smooth)[0].max() < 1e-9


def test_the_target_is_trimmed_to_what_the_source_covers():
    target, source = sphere(300, 0), sphere(300, 1)
    half = source[source[:, 0] < 0]
    kept = trim(target, half, 0.1)
    covered = np.linalg.norm(target[:, None] - half[None], axis=2).min(axis=1) < 0.1
    assert np.array_equal(kept, target[covered])
    assert 0.4 < covered.mean() < 0.65
    assert np.array_equal(trim(target, target, 0.1), target)
    for few in (0, 1, FEWEST_TRIMMED - 1, FEWEST_TRIMMED):  # with hardly any overlap nothing is trimmed
        kept = trim(target, np.concatenate([target[:few], target + np.array([0, 0, 20.0])]), 1e-6)
        assert len(kept) == (few if few >= FEWEST_TRIMMED else 300)


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
    T_icp = BatchedICP(target, SETTINGS_REMEDIES.icp).register(source, np.eye(4)[None])[0][0]
    xi_n_6 = random.normal(size=(13, 6)) * SETTINGS_REMEDIES.deviation_6()
    return RemedyRuns((source, target, np.eye(4), T_icp), PairDraws(xi_n_6, SETTINGS_REMEDIES, random))


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


@pytest.mark.parametrize("away", [0.0, 50.0])
def test_what_is_given_is_not_changed_and_no_overlap_at_all_gives_finite_flagged_outcomes(away):
    T, xi_n_6 = exp(np.full((1, 6), 0.05))[0], XI.copy()
    given = (sphere(200), sphere(200, 1) + np.array([away, 0.0, 0.0]), T, T.copy(), xi_n_6)
    before = [array.copy() for array in given]
    evaluate = RemedyRuns(given[:4], PairDraws(xi_n_6, SETTINGS_REMEDIES, np.random.default_rng(0)))
    for outcome in (evaluate(Remedies(*switches)) for switches in CORNERS):
        assert not away or outcome.degenerate
        assert np.isfinite(outcome.covariance).all() and np.isfinite(outcome.residual)
    assert all(np.array_equal(array, expected) for array, expected in zip(given, before, strict=True))
