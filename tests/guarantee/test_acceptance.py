"""The limit of accepted poses keeps its risk on families that it was not set on."""

from math import inf

import numpy as np
import pytest

from gpca.guarantee import acceptance
from gpca.guarantee.acceptance import accepted_below, accepted_in_hindsight


def drawn(random, families, size=12):
    """Scores that say how probable an error is, families of which are harder than their scores say."""
    score_N = random.beta(0.4, 1.2, size=families * size)
    harder_N = np.repeat(random.normal(0, 0.5, size=families), size)
    wrong_N = random.random(len(score_N)) < score_N * np.exp(harder_N)
    return score_N, wrong_N, np.repeat(np.arange(families), size)


def test_the_accepted_of_other_families_are_seldom_wrong():
    random = np.random.default_rng(0)
    shares, kept = [], 0
    for _ in range(60):
        limit = accepted_below(*drawn(random, 20))
        score_N, wrong_N, _ = drawn(random, 200)
        accepted_N = score_N < (limit or 0)
        kept += accepted_N.any()
        shares.append(wrong_N[accepted_N].mean() if accepted_N.any() else 0.0)
    assert kept > 50 and np.mean(shares) < 0.045 and np.mean(np.array(shares) <= 0.05) >= 0.7


@pytest.mark.parametrize(("count", "accepted"), [(18, False), (19, True)])
def test_few_right_poses_are_not_enough(count, accepted):
    score_N = np.arange(count) / count
    limit = accepted_below(score_N, np.zeros(count, bool), np.arange(count) % 5)
    assert limit == (pytest.approx(score_N[-1]) if accepted else None)


def test_equal_scores_are_accepted_together_and_in_hindsight_the_largest_limit_with_few_wrong(monkeypatch):
    score_N = np.array([0.1] * 40 + [0.2] * 40 + [inf])
    wrong_N = np.array([False] * 79 + [True, False])
    family_N = np.arange(81) % 8
    with monkeypatch.context() as patch:
        patch.setattr(acceptance, "WRONG", 0.03)
        patch.setattr(acceptance, "CONFIDENCE", 0.5)
        assert accepted_below(score_N, wrong_N, family_N) == pytest.approx(0.2)
    wrong_N[40:60] = True
    assert accepted_below(score_N, wrong_N, family_N) == pytest.approx(0.1)
    assert accepted_below(score_N[:0], wrong_N[:0], family_N[:0]) is None
    score_N, wrong_N = np.array([3.0, 1, 2, 2, inf]), np.array([False, False, True, False, False])
    weights_B_N = np.array([[1.0] * 5, [1, 1, 0, 1, 1], [0, 0, 1, 0, 0]])
    monkeypatch.setattr(acceptance, "WRONG", 0.3)
    accepted_B_N = accepted_in_hindsight(score_N, wrong_N, weights_B_N)
    assert accepted_B_N.tolist() == [[True] * 4 + [False], [True] * 4 + [False], [False] * 5]
    monkeypatch.setattr(acceptance, "WRONG", 0.2)
    assert accepted_in_hindsight(score_N, wrong_N, weights_B_N)[0].tolist() == [False, True] + [False] * 3
    assert accepted_in_hindsight(score_N[:0], wrong_N[:0], weights_B_N[:, :0]).shape == (3, 0)
