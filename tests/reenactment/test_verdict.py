import numpy as np
import pytest

from gpca.causes.settings import Limits
from gpca.reenactment.dataset import verdict

LIMITS = Limits()
ONE = np.array([1.0, 0, 0])


def errors_of(*phi, none=0.005):
    """The errors that causes with these φ make, each by itself."""
    return np.array([none + sum(phi[i] for i in range(3) if subset >> i & 1) for subset in range(8)])


def judged(*hypotheses, weight=None):
    errors_K_8 = np.array(hypotheses)
    return verdict(errors_K_8[None], np.array(weight or ONE[: len(hypotheses)])[None], LIMITS)[0]


def test_midway_between_the_limits_a_failure_is_as_probable_as_not():
    middle = np.sqrt(LIMITS.nominal * LIMITS.failed)
    assert judged(errors_of(middle - 0.005, 0, 0))[0] == pytest.approx(0.5)
    assert judged(errors_of(0.001, 0.001, 0))[0] > 0.95
    assert judged(errors_of(0.2, 0, 0))[0] < 0.01


def test_the_largest_share_is_the_most_probable_and_equal_ones_are_equally_probable():
    scores = judged(errors_of(0.02, 0.10, 0.05))
    assert np.argsort(scores).tolist() == [0, 1, 3, 2]
    even = judged(errors_of(0.05, 0.05, 0.05))
    assert even[1:] == pytest.approx(np.full(3, even[1]))


def test_hypotheses_count_as_much_as_they_are_probable():
    noise, pose = errors_of(0.3, 0, 0), errors_of(0, 0.3, 0)
    scores = judged(noise, pose, weight=[0.75, 0.25])
    assert scores[1:3] == pytest.approx([0.75, 0.25], abs=0.01)
