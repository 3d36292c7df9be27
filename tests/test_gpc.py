import numpy as np
import pytest
import torch

from gpca.errors import InputError
from gpca.gpc import GPC, GPCSettings

CLASSES = ("noise", "pose", "overlap")
QUICK = GPCSettings(learning_rate=0.05, iterations=40, inducing=12, draws=200)
CENTRES = 3 * np.random.default_rng(0).normal(size=(3, 16))


def blobs(n, seed):
    """Three Gaussian blobs in 16 dimensions, and the blob of each point."""
    blob = np.arange(n) % 3
    return CENTRES[blob] + np.random.default_rng(seed).normal(size=(n, 16)), np.array(CLASSES)[blob]


def fitted(h, labels, settings=QUICK, seed=0):
    return GPC(CLASSES, settings, "blobs", seed).fit(h, labels)


def predicted(gpc, h):
    return np.array(CLASSES)[gpc.attribute(h)[0].argmax(axis=1)]


H, LABELS = blobs(90, seed=1)
H_TEST, LABELS_TEST = blobs(90, seed=2)


@pytest.fixture(scope="module")
def gpc():
    return fitted(H, LABELS)


@pytest.mark.parametrize("kernel", ["rbf", "matern32"])
def test_separated_blobs_are_learnt(kernel):
    settings = GPCSettings(kernel, learning_rate=0.05, iterations=40, inducing=12, draws=200)
    assert np.mean(predicted(fitted(H, LABELS, settings), H_TEST) == LABELS_TEST) > 0.95


def test_scores_sum_to_one_and_variances_and_bald_stay_in_their_bounds(gpc):
    scores, variances, bald = gpc.attribute(np.concatenate([H_TEST, 100 * H_TEST]))
    assert scores.sum(axis=1) == pytest.approx(1)
    assert 0 <= variances.min() < variances.max() <= 0.25
    assert -1e-12 < bald.min() < bald.max() <= np.log(3)


def test_far_from_the_data_the_posterior_is_the_prior_and_bald_is_large(gpc):
    far, near = gpc.attribute(H_TEST + 1000.0), gpc.attribute(H_TEST)
    assert far[0] == pytest.approx(1 / 3, abs=0.1)
    assert far[2].min() > near[2].mean()


@pytest.mark.parametrize("rows", [[0], [0, 1, 2], [2, 1, 0], list(range(89, -1, -1))])
def test_a_result_does_not_depend_on_the_other_samples(gpc, rows):
    together = gpc.attribute(H_TEST)
    for whole, part in zip(together, gpc.attribute(H_TEST[rows]), strict=True):
        assert np.abs(whole[rows] - part).max() < 1e-6


@pytest.mark.parametrize("order", [[0, 1, 2], [1, 2, 0]])
def test_one_labelled_sample_of_each_class_is_enough_to_tell_them_apart(order):
    # As many samples as classes: gpytorch's own likelihood would read them transposed.
    labels = np.array(CLASSES)[order]
    assert predicted(fitted(H[:3], labels), H[:3]).tolist() == labels.tolist()


def test_a_class_without_a_label_has_larger_bald_than_those_seen():
    seen, absent = LABELS != "overlap", LABELS_TEST == "overlap"
    scores, _, bald = fitted(H[seen], LABELS[seen]).attribute(H_TEST)
    assert scores.shape == (90, 3)
    assert bald[absent].min() > np.median(bald[~absent])
    assert bald[absent].mean() > 2 * bald[~absent].mean()


def test_shuffled_labels_give_chance():
    def largest_of_three(n, seed):
        h = np.random.default_rng(seed).normal(size=(n, 8))
        return h, np.array(CLASSES)[h[:, :3].argmax(axis=1)]

    (h, labels), (h_test, labels_test) = largest_of_three(150, seed=1), largest_of_three(600, seed=2)
    shuffled = [np.random.default_rng(seed).permutation(labels) for seed in range(3)]
    accuracies = [
        np.mean(predicted(fitted(h, trained_on), h_test) == labels_test) for trained_on in (labels, *shuffled)
    ]
    assert accuracies[0] > 0.75
    assert 0.25 < np.mean(accuracies[1:]) < 0.42


def test_a_seed_repeats_every_byte_and_another_does_not(gpc):
    torch.rand(3)  # a draw of someone else's
    again, other = fitted(H, LABELS), fitted(H, LABELS, seed=1)
    results = zip(*(classifier.attribute(H_TEST) for classifier in (gpc, again, other)), strict=True)
    for expected, of_same_seed, of_other_seed in results:
        assert expected.tobytes() == of_same_seed.tobytes() != of_other_seed.tobytes()


def test_fitting_leaves_torchs_generator_where_it_was():
    before = torch.random.get_rng_state()
    fitted(H[:6], LABELS[:6])
    assert torch.equal(torch.random.get_rng_state(), before)


def test_repeated_and_few_points_can_be_fitted():
    h = np.repeat(H[:2], 4, axis=0)
    assert np.isfinite(fitted(h, np.repeat(LABELS[:2], 4)).attribute(h)[0]).all()


def test_an_unknown_kernel_is_named():
    with pytest.raises(InputError, match=r"kernel 'linear': unknown; known are rbf, matern32"):
        GPCSettings("linear")
