"""Intervals over draws, of shares, means and paired differences."""

from statistics import NormalDist

import numpy as np
import pytest

from baselines import trivial, untrained
from baselines.untrained import CAUSE_EXPLAINERS as CAUSES_OF
from gpca.evaluation import intervals
from gpca.evaluation.intervals import (
    interval,
    mean_interval,
    mean_ranks,
    quantile_bounds,
    student_factor,
    wilson_interval,
)
from gpca.seeds import generator

SEED = np.repeat([100, 101], 6)
OBJECT = np.tile(["cup", "can", "drill"], 4)


def draws(*axes):
    return intervals.pigeonhole_weights(generator(*axes), SEED, OBJECT)


def test_a_draw_of_objects_and_seeds_weighs_a_sample_by_both():
    weights = draws("tiny")
    assert np.array_equal(weights, draws("tiny"))
    assert not np.array_equal(weights, draws("other"))
    for seed, name in ((100, "cup"), (101, "drill")):
        same = weights[:, (seed == SEED) & (name == OBJECT)]
        assert (same == same[:, :1]).all()
    assert (weights[:, [0, 1, 2, 6, 7, 8]].sum(axis=1) == 2 * 3).all()  # as many of both are drawn as there are


def bounds(value_B, *args, **options):
    """Return the bounds of draws whose statistic on the samples themselves is their median."""
    return interval(np.append(np.nanmedian(value_B), value_B), *args, **options)[1:]


def test_bounds_are_the_quantiles_of_the_draws_that_have_a_value():
    values = np.append(np.arange(101.0), np.nan)
    assert quantile_bounds(values) == pytest.approx((2.5, 97.5))
    assert interval(np.append(3.0, values)) == (3.0, *quantile_bounds(values))
    assert np.isnan(quantile_bounds(np.array([np.nan]))).all()
    assert np.isnan(interval(np.full(4, np.nan), np.ones((3, 2)))).all()


def test_a_share_has_wilsons_interval_where_all_draws_agree_and_is_never_surer_than_that():
    weights = draws("tiny")
    assert intervals.independent(weights) == 2 * 3  # an object counts once in each seed, with two samples of each
    assert intervals.independent(weights[:, OBJECT == "cup"]) == 2
    ones = np.ones(len(weights))
    assert bounds(ones) == (1, 1)
    assert bounds(ones, weights) == wilson_interval(6, 6)
    assert bounds(0 * ones, weights) == wilson_interval(0, 6)
    assert bounds(0.5 * ones, weights) == wilson_interval(3, 6)
    narrow, wide = np.linspace(0.7, 0.8, len(weights)), np.linspace(0, 1, len(weights))
    assert interval(np.append(0.75, narrow), weights) == (0.75, *wilson_interval(9, 12))
    assert bounds(wide, weights) == quantile_bounds(wide)
    skewed = np.append(0.75, np.linspace(0.7, 1, len(weights)))
    assert interval(skewed, weights)[1:] == (wilson_interval(9, 12)[0], quantile_bounds(skewed[1:])[1])
    assert interval(skewed, weights, samples=1000)[1:] == quantile_bounds(skewed[1:])  # a column may stand for many


def test_a_difference_on_which_all_draws_agree_has_a_width_too():
    weights = draws("tiny")
    ones, most = np.ones(len(weights)), wilson_interval(0, 6)[1]
    assert bounds(0 * ones, weights, difference=True) == (-most, most)
    low, high = wilson_interval(3, 6)
    assert bounds(0.5 * ones, weights, difference=True) == (low, high)
    assert bounds(-0.5 * ones, weights, difference=True) == (-high, -low)
    narrow = np.linspace(0.1, 0.2, len(weights))
    assert bounds(narrow, weights, difference=True) == quantile_bounds(narrow)


def test_the_wilson_interval_is_that_of_the_literature():
    assert wilson_interval(8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-4)
    assert wilson_interval(0, 10) == pytest.approx((0.0, 0.2775), abs=1e-4)
    low, high = wilson_interval(10, 10)
    assert (low, high) == (pytest.approx(0.7225, abs=1e-4), 1.0)


def test_mean_interval_is_students_and_covers_the_mean_as_often_as_it_says():
    # Three repeats 1, 2, 3: s = 1, t_2(0.975) = 4.302653, half-width 4.302653 / sqrt(3).
    mean, low, high = mean_interval([1, 2, 3])
    assert mean == 2
    assert high - mean == pytest.approx(2.484138, abs=1e-6)
    assert mean - low == pytest.approx(high - mean)
    draws = np.random.default_rng(0).normal(size=(2000, 5))
    covered = [low <= 0 <= high for _, low, high in map(mean_interval, draws)]
    assert np.mean(covered) == pytest.approx(0.95, abs=0.02)
    mean, low, high = mean_interval([0.7])
    assert mean == 0.7
    assert np.isnan([low, high]).all()
    assert np.isnan(mean_interval([0.7, np.nan])).all()
    with pytest.raises(ValueError, match="no repeats"):
        mean_interval([])


N = 300
RIGHT = {
    name: np.random.default_rng(seed).random(N) < share
    for seed, (name, share) in enumerate({"rule": 0.5, "chance": 0.3, "good": 0.8, "poor": 0.1}.items())
}
WEIGHTS = np.vstack([np.ones(N), intervals.pigeonhole_weights(np.random.default_rng(9), np.arange(N) // 3)])
VALUES = {name: intervals.weighted_mean(right_N, WEIGHTS) for name, right_N in RIGHT.items()}


def test_the_best_trivial_one_is_beaten_by_a_paired_difference():
    assert VALUES["good"].shape == (1 + intervals.REPEATS,)
    assert VALUES["good"][0] == RIGHT["good"].mean()
    assert VALUES["good"][1:].std() > 0
    for entries, more in ((untrained.EXPLAINERS, trivial.EXPLAINERS), (CAUSES_OF, trivial.CAUSE_EXPLAINERS)):
        assert {*intervals.TRIVIAL} - {"density"} == {*entries, *more}
    assert (
        intervals.best_of(VALUES, intervals.TRIVIAL) == "rule"
        and intervals.best_of(VALUES, intervals.TRIVIAL, least_is_best=True) == "chance"
    )
    value, low, high = interval(VALUES["good"] - VALUES["rule"], difference=True)
    assert 0 < low < value < high
    assert value == pytest.approx(RIGHT["good"].mean() - RIGHT["rule"].mean())
    alone = {"good": VALUES["good"], "rule": np.full(1 + intervals.REPEATS, np.nan)}
    assert intervals.best_of(alone, intervals.TRIVIAL) == ""


def test_ranks_and_the_factors_of_student_are_those_of_scipy_stats():
    from scipy import stats

    draws = np.random.default_rng(0)
    for values_N in (draws.normal(size=50), draws.integers(0, 5, 60), np.zeros(0), np.array([1.0, np.nan, np.inf])):
        assert np.array_equal(mean_ranks(values_N), stats.rankdata(values_N), equal_nan=True)
    for repeats in range(1, 30):
        assert np.array_equal(student_factor(repeats), stats.t.ppf(0.975, repeats - 1), equal_nan=True)


def test_differences_are_corrected_for_being_picked_and_show_nothing_with_few_clusters():
    value, half, many = np.array([9.0, 2.1, 2.0, np.nan, 0.5]), 2.0, np.full(5, 10**6)
    low, high = intervals.corrected(value, value - half, value + half, many)
    usual = NormalDist().inv_cdf(0.975)
    # The clear one is tested at a fourth of the level, the others at a third, at which the next is not shown.
    factors = [NormalDist().inv_cdf(1 - 0.025 / m) / usual for m in (4, 3, 3, 3)]
    measured = [0, 1, 2, 4]
    assert (high - value)[measured] == pytest.approx(half * np.array(factors), rel=1e-4)
    assert low[0] > 0 > low[1] and np.isnan(low[3]) and np.isnan(high[3])
    alone, _ = intervals.corrected(value, value - half, value + half, many, picked=False)
    assert alone[1] > 0  # not picked from several
    few, most = intervals.corrected(value, value - half, value + half, np.array([4, 5, 5, 5, 5]))
    assert few[0] == 0 and most[0] > high[0]
    ten, _ = intervals.corrected(value[:1], value[:1] - half, value[:1] + half, np.array([10]))
    assert value[0] - ten[0] == pytest.approx(half * 2.2622 / usual, rel=1e-4)
