import numpy as np
import pytest

from gpca.evaluation.intervals import (
    REPEATS,
    UNTRAINED,
    Difference,
    best_of,
    difference,
    from_rival,
    from_untrained,
    pigeonhole_weights,
    weighted_mean,
)

N = 300
RIGHT = {
    name: np.random.default_rng(seed).random(N) < share
    for seed, (name, share) in enumerate({"rule": 0.5, "chance": 0.3, "good": 0.8, "poor": 0.1}.items())
}
WEIGHTS = np.vstack([np.ones(N), pigeonhole_weights(np.random.default_rng(9), np.arange(N) // 3)])
VALUES = {name: weighted_mean(right_N, WEIGHTS) for name, right_N in RIGHT.items()}


def test_weighted_means_are_those_of_the_samples_and_then_of_every_draw():
    assert VALUES["good"].shape == (1 + REPEATS,)
    assert VALUES["good"][0] == RIGHT["good"].mean()
    assert VALUES["good"][1:].std() > 0


def test_the_best_untrained_one_is_beaten_by_a_paired_difference():
    found = from_untrained(VALUES, "good")
    assert found.other == "rule"
    assert found.value == pytest.approx(RIGHT["good"].mean() - RIGHT["rule"].mean())
    assert 0 < found.low < found.value < found.high
    assert from_untrained(VALUES, "rule").other == "chance"
    assert from_untrained(VALUES, "poor", least_is_best=True).other == "chance"


def test_an_interval_is_that_of_the_differences_and_not_of_the_two():
    shifted = VALUES["good"] - 0.1
    found = difference({"a": VALUES["good"], "b": shifted}, "a", "b")
    assert (found.value, found.low, found.high) == pytest.approx((0.1, 0.1, 0.1))


def test_without_another_there_is_no_difference():
    alone = {"good": VALUES["good"], "rule": np.full(1 + REPEATS, np.nan)}
    assert from_untrained(alone, "good").cells == ("", *[pytest.approx(np.nan, nan_ok=True)] * 3)
    assert best_of(alone, UNTRAINED) == ""
    assert difference(VALUES, "good", "") == Difference() or np.isnan(Difference().value)


def test_the_rival_is_the_best_of_those_that_may_be():
    assert from_rival(VALUES, "good", list(VALUES)).other == "rule"
    assert from_rival(VALUES, "rule", list(VALUES)).other == "good"
    assert from_rival(VALUES, "rule", ["poor", "rule"]).other == "poor"


def test_the_untrained_explainers_are_those_of_their_file():
    from baselines import untrained

    assert tuple(untrained.EXPLAINERS) == tuple(untrained.CAUSE_EXPLAINERS) == UNTRAINED
