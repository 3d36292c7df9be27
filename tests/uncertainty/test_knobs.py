import numpy as np
import pytest
from scipy.optimize import linprog

from gpca.alignment.rigid import exp
from gpca.errors import InputError
from gpca.pairs.perturbation import Severities
from gpca.uncertainty import interventions
from gpca.uncertainty.interventions import MIDDLE, MOST, UNTOUCHED, UPPER, KnobRuns, Knobs
from gpca.uncertainty.settings import UncertaintySettings
from gpca.uncertainty.spread import run_from_starts

SETTINGS = UncertaintySettings(starts=13)
XI = np.random.default_rng(0).normal(size=(13, 6)) * SETTINGS.deviation_6()
CLOUD = np.random.default_rng(1).normal(size=(240, 3))
CLOUD *= [0.5, 0.35, 0.2] / np.linalg.norm(CLOUD, axis=1, keepdims=True)
SOURCE, TARGET = CLOUD[:120], CLOUD[120:]
T_INIT, T_REF = exp(np.array([[0.1, 0, 0, 0, 0.02, 0], [0.0, 0.1, 0, 0.01, 0, 0]]))


def knob_runs(source=SOURCE, target=TARGET, seed=0):
    return KnobRuns(source, target, T_INIT, T_REF, XI, SETTINGS, np.random.default_rng(seed))


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


@pytest.mark.parametrize("value", [-1e-9, -1.0, np.nan, np.inf])
@pytest.mark.parametrize("name", Knobs._fields)
def test_a_knob_outside_its_range_is_named(calls, name, value):
    with pytest.raises(InputError, match=rf"knob '{name}': {value} is outside \[0, ") as caught:
        knob_runs()(UNTOUCHED._replace(**{name: value}))
    assert "\n" not in str(caught.value) and not calls


def test_the_ends_of_the_ranges_belong_to_them():
    runs = knob_runs()
    for name in Knobs._fields:
        assert np.isfinite(runs(UNTOUCHED._replace(**{name: getattr(MOST, name)})).residual)
        with pytest.raises(InputError, match=f"knob '{name}'"):
            runs(UNTOUCHED._replace(**{name: getattr(MOST, name) * 1.001}))
    still = runs(Knobs(0.0, 0.0, 0.0))  # no spread of the starts: one pose in all runs
    assert still.degenerate and np.allclose(still.covariance, 0, atol=1e-12) and np.isfinite(still.residual)


def test_middle_and_upper_ends_are_those_of_the_severities():
    ranges = Severities()
    rotation_over_starts = np.array(ranges.rotation_deg) / SETTINGS.start_rotation_deg
    translation_over_starts = np.array(ranges.translation) / SETTINGS.start_translation
    assert (UPPER.noise, UPPER.overlap) == (ranges.noise[1], ranges.crop[1])
    assert [rotation_over_starts[1], translation_over_starts[1]] == pytest.approx([UPPER.spread] * 2)
    assert (MIDDLE.noise, MIDDLE.overlap) == pytest.approx((np.mean(ranges.noise), np.mean(ranges.crop)))
    assert MIDDLE.spread == pytest.approx(rotation_over_starts.mean())
    assert (np.diff([(0, 1, 0), MIDDLE, UPPER, MOST], axis=0) > 0).all()


def test_at_rest_the_pair_is_as_it_is(calls):
    knob_runs()(UNTOUCHED)
    (source, T_init, xi_n_6), *_ = calls
    assert np.array_equal(source, SOURCE) and np.array_equal(T_init, T_INIT) and np.array_equal(xi_n_6, XI)


def test_noise_is_the_same_jitter_times_its_deviation(calls):
    runs = knob_runs()
    for noise in (0.01, 0.03, 0.5):
        runs(Knobs(noise))
    jitters = [(source - SOURCE) / noise for (source, _, _), noise in zip(calls, (0.01, 0.03, 0.5), strict=True)]
    assert np.allclose(jitters[0], jitters[1]) and np.allclose(jitters[0], jitters[2])
    assert jitters[0].std(axis=0) == pytest.approx(1, abs=0.2)
    assert np.abs(jitters[0].mean(axis=0)).max() < 0.4
    assert all(np.array_equal(xi_n_6, XI) for _, _, xi_n_6 in calls)


def test_spread_scales_the_starts(calls):
    runs = knob_runs()
    for spread in (0.5, 6.0):
        runs(Knobs(spread=spread))
    assert np.array_equal(calls[0][2], 0.5 * XI) and np.array_equal(calls[1][2], 6.0 * XI)
    assert all(np.array_equal(source, SOURCE) and np.array_equal(T, T_INIT) for source, T, _ in calls)


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


def test_all_knobs_together_are_each_of_them(calls):
    runs = knob_runs()
    for setting in (Knobs(noise=0.02), Knobs(overlap=0.4), Knobs(0.02, 3.0, 0.4)):
        runs(setting)
    (noisy, _, _), (cut, _, _), (both, _, xi_n_6) = calls
    assert np.array_equal(both, noisy[rows_of(cut)])
    assert np.array_equal(xi_n_6, 3.0 * XI)


@pytest.mark.parametrize("points", [3, 4, 20])
def test_the_heaviest_cut_leaves_three_points_and_a_finite_outcome(calls, points):
    result = knob_runs(SOURCE[:points])(Knobs(overlap=MOST.overlap))
    assert len(calls[0][0]) == 3
    assert np.isfinite(result.covariance).all() and np.isfinite(result.residual)


def test_empty_overlap_is_flagged_and_finite():
    """Whatever is left of the source lies out of reach of the target."""
    for setting in (UNTOUCHED, UPPER):
        result = knob_runs(target=TARGET + np.array([50.0, 0.0, 0.0]))(setting)
        assert result.degenerate and np.isfinite(result.covariance).all() and np.isfinite(result.residual)


def test_the_same_points_as_source_and_target_give_a_finite_outcome():
    runs = KnobRuns(TARGET, TARGET, np.eye(4), np.eye(4), 0.05 * XI, SETTINGS, np.random.default_rng(0))
    still, noisy = runs(UNTOUCHED), runs(Knobs(0.03))
    assert still.degenerate and np.isfinite(still.covariance).all()
    assert still.residual == pytest.approx(np.log(1e-6)) and noisy.residual > still.residual


def test_too_few_points_are_refused():
    with pytest.raises(InputError, match="source cloud"):
        knob_runs(SOURCE[:2])(UNTOUCHED)
    with pytest.raises(InputError, match="target cloud"):
        knob_runs(target=TARGET[:2])
