import numpy as np
import pytest

from gpca.active_learning.stream_models import MondrianForest

CENTERS = np.array([[0.0, 0], [4, 0], [0, 4]])


def blobs(n, seed):
    label_N = np.arange(n) % 3
    return CENTERS[label_N] + np.random.default_rng(seed).normal(size=(n, 2)), label_N


def forest(x_N_D, label_N, order=None, seed=0, trees=20, first=None):
    """A forest that gets the first samples at once and the others one by one."""
    made = MondrianForest(3, np.random.default_rng(seed), trees)
    order = np.arange(len(x_N_D)) if order is None else order
    first = len(order) if first is None else first
    for rows in (order[:first], *order[first:, None]):
        if len(rows):
            made.learn(x_N_D[rows], label_N[rows])
    return made


def boxes(node, earlier=0.0):
    yield node, earlier
    for child in node.children or ():
        yield from boxes(child, node.time)


def samples(node):
    if node.children is None:
        return node.x_N_D
    return np.concatenate([samples(child) for child in node.children])


@pytest.fixture(scope="module")
def grown():
    return forest(*blobs(60, 0), first=1)


def test_it_knows_nothing_before_the_first_sample_and_one_class_after_it():
    made = MondrianForest(3, np.random.default_rng(0), 5)
    assert made.scores(np.zeros((2, 2))) == pytest.approx(np.full((2, 3), 1 / 3))
    made.learn(np.zeros((1, 2)), np.array([2]))
    assert made.scores(np.zeros((1, 2)))[0] == pytest.approx([0, 0, 1])


def test_blobs_are_told_apart_and_the_scores_are_probabilities(grown):
    x_N_D, label_N = blobs(90, 1)
    scores_N_C = grown.scores(x_N_D)
    assert scores_N_C.sum(axis=1) == pytest.approx(1)
    assert (scores_N_C >= 0).all()
    assert np.mean(scores_N_C.argmax(axis=1) == label_N) > 0.9


def test_far_from_everything_the_scores_are_those_of_no_class(grown):
    near, far = grown.scores(np.array([[4.0, 0], [4000, -4000]]))
    assert near.max() > 0.8
    assert far == pytest.approx(np.full(3, 1 / 3), abs=0.05)


def test_the_boxes_hold_their_samples_and_split_later_than_their_parents(grown):
    for root in grown._roots:
        assert len(samples(root)) == 60
        for node, earlier in boxes(root):
            assert node.time > earlier
            own = samples(node)
            assert (node.low_D == own.min(axis=0)).all()
            assert (node.high_D == own.max(axis=0)).all()
            if node.children:
                below, above = (samples(child)[:, node.axis] for child in node.children)
                assert below.max() <= node.place < above.min()


def test_a_leaf_of_one_class_waits():
    made = forest(np.random.default_rng(0).normal(size=(30, 2)), np.full(30, 1), first=1)
    assert all(root.children is None and root.counts_C.tolist() == [0, 30, 0] for root in made._roots)


def test_samples_at_one_place_share_a_leaf():
    made = forest(np.zeros((4, 2)), np.array([0, 0, 0, 1]))
    assert made.scores(np.zeros((1, 2)))[0] == pytest.approx([0.75, 0.25, 0])


def test_it_does_not_matter_whether_samples_come_at_once_or_one_by_one():
    x_N_D, label_N = blobs(30, 3)
    asked = blobs(15, 4)[0]
    at_once = forest(x_N_D, label_N, trees=100).scores(asked)
    backwards = forest(x_N_D, label_N, order=np.arange(30)[::-1], first=1, seed=1, trees=100).scores(asked)
    assert np.abs(at_once - backwards).max() < 0.2
    assert np.abs(at_once - backwards).mean() < 0.04


def test_a_samples_scores_do_not_depend_on_the_others(grown):
    asked = blobs(9, 5)[0]
    assert grown.scores(asked[[4]])[0] == pytest.approx(grown.scores(asked)[4], abs=1e-12)
