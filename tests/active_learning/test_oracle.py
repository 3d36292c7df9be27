import numpy as np
import pytest

from gpca.active_learning.oracle import answers

CLASSES = ("noise", "pose", "overlap", "geometry")


@pytest.fixture(scope="module")
def truth():
    return np.random.default_rng(0).choice(["noise", "pose", "overlap"], 200)


@pytest.mark.parametrize(("share", "wrong"), [(0.0, 0), (0.05, 10), (0.3, 60), (0.999, 200)])
def test_that_share_of_the_answers_is_wrong(truth, share, wrong):
    said = answers(truth, CLASSES, share, "tiny", 0)
    assert np.sum(said != truth) == wrong
    assert set(said.tolist()) <= set(CLASSES)


def test_every_other_concept_is_named_by_mistake(truth):
    said = answers(truth, CLASSES, 0.999, "tiny", 0)
    assert set(said[truth == "pose"].tolist()) == {"noise", "overlap", "geometry"}


def test_a_worse_oracle_repeats_the_errors_of_a_better_one(truth):
    better, worse = (answers(truth, CLASSES, share, "tiny", 0) for share in (0.1, 0.3))
    wrong = better != truth
    assert np.array_equal(better[wrong], worse[wrong])


def test_errors_are_named_by_the_axes(truth):
    first, again, other = (answers(truth, CLASSES, 0.2, "tiny", seed) for seed in (0, 0, 1))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
