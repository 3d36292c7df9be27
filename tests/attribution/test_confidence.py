import numpy as np
import pytest

from gpca.attribution.confidence import bounds, independent, pigeonhole_weights, wilson_interval
from gpca.seeds import generator

SEED = np.repeat([100, 101], 6)
OBJECT = np.tile(["cup", "can", "drill"], 4)


def draws(*axes):
    return pigeonhole_weights(generator(*axes), SEED, OBJECT)


def test_a_draw_of_objects_and_seeds_weighs_a_sample_by_both():
    weights = draws("tiny")
    assert np.array_equal(weights, draws("tiny"))
    assert not np.array_equal(weights, draws("other"))
    for seed, name in ((100, "cup"), (101, "drill")):
        same = weights[:, (seed == SEED) & (name == OBJECT)]
        assert (same == same[:, :1]).all()
    assert (weights[:, [0, 1, 2, 6, 7, 8]].sum(axis=1) == 2 * 3).all()  # as many of both are drawn as there are


def test_bounds_are_those_of_the_draws_that_have_a_value():
    values = np.append(np.arange(101.0), np.nan)
    assert bounds(values) == pytest.approx((2.5, 97.5))
    assert np.isnan(bounds(np.array([np.nan]))).all()


def test_a_share_that_all_draws_agree_on_has_wilsons_interval_of_its_clusters():
    weights = draws("tiny")
    assert independent(weights) == 2 * 3  # an object counts once in each seed, with two samples of each
    assert independent(weights[:, OBJECT == "cup"]) == 2
    ones = np.ones(len(weights))
    assert bounds(ones) == (1, 1)
    assert bounds(ones, weights) == wilson_interval(6, 6)
    assert bounds(0 * ones, weights) == wilson_interval(0, 6)
    assert bounds(0.5 * ones, weights) == wilson_interval(3, 6)
    varied = np.linspace(0.5, 1, len(weights))
    assert bounds(varied, weights) == bounds(varied)


def test_a_difference_that_all_draws_agree_on_has_a_width_too():
    weights = draws("tiny")
    ones, most = np.ones(len(weights)), wilson_interval(0, 6)[1]
    assert bounds(0 * ones, weights, difference=True) == (-most, most)
    low, high = wilson_interval(3, 6)
    assert bounds(0.5 * ones, weights, difference=True) == (low, high)
    assert bounds(-0.5 * ones, weights, difference=True) == (-high, -low)


def test_the_wilson_interval_is_that_of_the_literature():
    assert wilson_interval(8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-4)
    assert wilson_interval(0, 10) == pytest.approx((0.0, 0.2775), abs=1e-4)
    low, high = wilson_interval(10, 10)
    assert (low, high) == (pytest.approx(0.7225, abs=1e-4), 1.0)
    with pytest.raises(ValueError, match="no trials"):
        wilson_interval(0, 0)
