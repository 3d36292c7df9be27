"""Bounds for a further sample: their ranks, and how often they hold in simulations."""

from math import ceil, inf

import numpy as np
import pytest
from scipy.stats import beta

from gpca.errors import InputError
from gpca.guarantee.conformal import confident_upper_bound, highest_level, require_share, upper_bound

DRAWS = 4000


@pytest.mark.parametrize(("samples", "level"), [(9, 0.9), (19, 0.9), (20, 0.9), (99, 0.95), (100, 0.95), (57, 0.8)])
def test_the_bound_is_the_value_of_the_rank_that_split_conformal_prediction_names(samples, level):
    values = np.random.default_rng(0).permutation(samples).astype(float)
    rank = ceil(round((samples + 1) * level, 9))
    assert upper_bound(values, level) == rank - 1
    # NumPy's quantile of type 1, at the level that is corrected for the finite sample, as MAPIE takes it
    corrected = min(1.0, (samples + 1) * level / samples)
    assert upper_bound(values, level) == np.quantile(values, corrected - 1e-12, method="inverted_cdf")


def test_too_few_samples_or_families_bound_nothing():
    assert upper_bound(np.arange(8.0), 0.9) == inf and upper_bound(np.arange(9.0), 0.9) == 8
    families = np.repeat(np.arange(8), 50)
    assert upper_bound(np.arange(400.0), 0.9, families) == inf and upper_bound(np.empty(0), 0.5) == inf
    assert highest_level(9) == 0.9 and highest_level(400, families) == pytest.approx(8 / 9)
    assert confident_upper_bound(np.arange(58.0), 0.95, 0.95) == inf
    assert confident_upper_bound(np.arange(59.0), 0.95, 0.95) == 58


def test_the_bound_holds_exactly_as_often_as_promised():
    random = np.random.default_rng(1)
    drawn = random.random((DRAWS, 40))
    held = np.mean([row[-1] <= upper_bound(row[:-1], 0.9) for row in drawn])
    # Of 40 exchangeable values the last is among the 36 smallest in 36 of 40 orders.
    assert held == pytest.approx(0.9, abs=4 * np.sqrt(0.09 / DRAWS))


def test_families_of_one_sample_each_are_samples():
    values = np.random.default_rng(2).random(30)
    assert upper_bound(values, 0.9, np.arange(30)) == upper_bound(values, 0.9)


def of_families(random, families, samples):
    """Values of samples that differ more between families than within: (K, n)."""
    return random.normal(size=(families, 1)) + 0.1 * random.normal(size=(families, samples))


def test_for_a_new_family_the_bound_by_families_holds_and_that_by_samples_does_not():
    random = np.random.default_rng(3)
    by_family, by_sample = [], []
    families = np.repeat(np.arange(11), 20)
    for _ in range(DRAWS):
        values = of_families(random, 12, 20)
        known, new = values[:-1].ravel(), values[-1]
        by_family.append((new <= upper_bound(known, 0.9, families)).mean())
        by_sample.append((new <= upper_bound(known, 0.9)).mean())
    deviation = np.std(by_family) / np.sqrt(DRAWS)
    assert np.mean(by_family) >= 0.9 - 4 * deviation
    assert np.mean(by_sample) < 0.9 - 4 * deviation


def test_the_confident_bound_holds_for_the_promised_share_of_draws():
    random = np.random.default_rng(4)
    samples, level, confidence = 100, 0.95, 0.9
    covered = np.array([confident_upper_bound(random.random(samples), level, confidence) for _ in range(DRAWS)])
    ranks = np.arange(1, samples + 1)
    exact_of_rank = beta.sf(level, ranks, samples + 1 - ranks)  # of an ordered uniform value
    exact = exact_of_rank[exact_of_rank >= confidence].min()
    assert np.mean(covered >= level) == pytest.approx(exact, abs=4 * np.sqrt(exact * (1 - exact) / DRAWS))


@pytest.mark.parametrize("share", [0, 1, -0.1, 1.5, np.nan])
def test_a_share_has_to_lie_between_0_and_1(share):
    with pytest.raises(InputError, match=r"level: .* is not strictly between 0 and 1; give a share"):
        require_share("level", share)
