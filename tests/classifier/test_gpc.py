from copy import copy
from dataclasses import replace

import numpy as np
import pytest
import torch
from sklearn.preprocessing import StandardScaler

from gpca.classifier.gpc import GPC
from gpca.classifier.prior import COVARIANCES, Standardization
from gpca.classifier.settings import GPCSettings

CLASSES = ("noise", "pose", "overlap")
QUICK = GPCSettings(learning_rate=0.05, iterations=40, inducing=12, draws=200)
CENTERS = 3 * np.random.default_rng(0).normal(size=(3, 16))


def blobs(n, seed):
    """Three Gaussian blobs in 16 dimensions, and the blob of each point."""
    blob = np.arange(n) % 3
    return CENTERS[blob] + np.random.default_rng(seed).normal(size=(n, 16)), np.array(CLASSES)[blob]


def fitted(h, labels, settings=QUICK, seed=0):
    return GPC(CLASSES, settings, "blobs", seed).fit(h, labels)


def predicted(gpc, h):
    return np.array(CLASSES)[gpc.attribute(h)[0].argmax(axis=1)]


H, LABELS = blobs(90, seed=1)
H_TEST, LABELS_TEST = blobs(90, seed=2)


@pytest.fixture(scope="module")
def gpc():
    return fitted(H, LABELS)


def test_scores_stay_in_their_bounds_and_far_from_the_data_are_the_prior(gpc):
    scores, variances, bald = gpc.attribute(np.concatenate([H_TEST, 100 * H_TEST]))
    assert scores.sum(axis=1) == pytest.approx(1)
    assert 0 <= variances.min() < variances.max() <= 0.25
    assert -1e-12 < bald.min() < bald.max() <= np.log(3)
    far, near = gpc.attribute(H_TEST + 1000.0), gpc.attribute(H_TEST)
    assert far[0] == pytest.approx(1 / 3, abs=0.1)
    assert far[2].min() > near[2].mean()


@pytest.mark.parametrize("rows", [[0], [0, 1, 2], [2, 1, 0], list(range(89, -1, -1))])
def test_a_result_does_not_depend_on_the_other_samples(gpc, rows):
    together = gpc.attribute(H_TEST)
    for whole, part in zip(together, gpc.attribute(H_TEST[rows]), strict=True):
        assert np.abs(whole[rows] - part).max() < 1e-6


@pytest.mark.parametrize("order", [[0, 1, 2], [1, 2, 0]])
def test_one_labeled_sample_of_each_class_is_enough_to_tell_them_apart(order):
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


def test_a_seed_repeats_every_byte_another_does_not_and_torchs_generator_stays(gpc):
    torch.rand(3)  # a draw of someone else's
    before = torch.random.get_rng_state()
    again, other = fitted(H, LABELS), fitted(H, LABELS, seed=1)
    assert torch.equal(torch.random.get_rng_state(), before)
    results = zip(*(classifier.attribute(H_TEST) for classifier in (gpc, again, other)), strict=True)
    for expected, of_same_seed, of_other_seed in results:
        assert expected.tobytes() == of_same_seed.tobytes() != of_other_seed.tobytes()


@pytest.mark.parametrize("kernel", COVARIANCES)
def test_on_the_way_it_is_what_fewer_iterations_make_it(kernel):
    settings = replace(QUICK, kernel=kernel, iterations=9, draws=50)
    longer = GPC(CLASSES, settings, "blobs", 0)
    for done in longer.fit_up_to([4, 9], H, LABELS):
        stopped = fitted(H, LABELS, replace(settings, iterations=done))
        assert stopped.elbo() == longer.elbo()
        for expected, on_the_way in zip(stopped.attribute(H_TEST), longer.attribute(H_TEST), strict=True):
            assert np.array_equal(expected, on_the_way)
    assert done == 9


SEEN, NEW = LABELS != "overlap", np.flatnonzero(LABELS == "overlap")


def fitted_without_overlap(settings=QUICK):
    return GPC(CLASSES, settings, "blobs", 0).fit(H[SEEN], LABELS[SEEN], H)


def accuracy(gpc, h, labels):
    return np.mean(np.array(gpc.classes)[gpc.attribute(h)[0].argmax(axis=1)] == labels)


@pytest.mark.parametrize("kernel", COVARIANCES)
def test_labels_of_the_missing_class_make_it_recognized(kernel):
    gpc = fitted_without_overlap(replace(QUICK, kernel=kernel))
    assert "overlap" not in predicted(gpc, H_TEST)
    gpc.level()
    gpc.update(H[NEW[:6]], LABELS[NEW[:6]])
    assert accuracy(gpc, H_TEST, LABELS_TEST) > 0.95


def test_an_update_takes_embeddings_or_projections_and_lowers_bald_where_its_labels_are():
    by_embeddings = fitted_without_overlap()
    by_projection = copy(by_embeddings)
    by_embeddings.update(H[NEW[:4]], LABELS[NEW[:4]])
    by_projection.update(by_projection.project(H[NEW[:4]]), LABELS[NEW[:4]])
    for one, other in zip(by_embeddings.attribute(H_TEST), by_projection.attribute(H_TEST), strict=True):
        assert np.array_equal(one, other)
    gpc = fitted_without_overlap()
    before = gpc.attribute(H[NEW])[2]
    gpc.update(H[NEW], LABELS[NEW])
    assert gpc.attribute(H[NEW])[2].mean() < before.mean() / 2


CHANGES = {
    "update": lambda gpc: gpc.update(H[NEW[:4]], LABELS[NEW[:4]]),
    "level": lambda gpc: gpc.level(),
    "grow": lambda gpc: gpc.grow("blur"),
    "refine": lambda gpc: gpc.refine(),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_what_changes_a_classifier_leaves_an_earlier_copy_as_it_was(change):
    gpc = fitted_without_overlap()
    earlier, before = copy(gpc), gpc.attribute(H_TEST)
    change(gpc)
    after = gpc.attribute(H_TEST)
    assert before[0].shape != after[0].shape or not np.array_equal(before[0], after[0])
    for expected, of_copy in zip(before, earlier.attribute(H_TEST), strict=True):
        assert np.array_equal(expected, of_copy)
    # Nor does a copy lack anything that it needs to learn on its own.
    change(earlier)
    for expected, of_copy in zip(after, earlier.attribute(H_TEST), strict=True):
        assert np.array_equal(expected, of_copy)


@pytest.mark.parametrize("kernel", COVARIANCES)
def test_a_class_added_later_costs_the_others_nothing_and_is_learned(kernel):
    fourth = np.full(16, 3.0) * np.random.default_rng(4).choice([-1, 1], size=16)
    h_new = fourth + np.random.default_rng(5).normal(size=(30, 16))
    settings = replace(QUICK, kernel=kernel, inducing=16)
    gpc = GPC(CLASSES, settings, "blobs", 0).fit(H, LABELS, np.concatenate([H, h_new]))
    before = gpc.attribute(H_TEST)[0]
    gpc.grow("blur")
    scores, variances, bald = gpc.attribute(H_TEST)
    assert gpc.classes == (*CLASSES, "blur")
    assert scores.shape == variances.shape == (90, 4)
    assert bald.max() <= np.log(4)
    assert scores.sum(axis=1) == pytest.approx(1)
    assert (scores.argmax(axis=1) == before.argmax(axis=1)).all()
    assert accuracy(gpc, h_new, "blur") < 0.2
    gpc.update(h_new[:6], ["blur"] * 6)
    assert accuracy(gpc, h_new[6:], "blur") > 0.95
    gpc.grow("fog")
    assert gpc.attribute(H_TEST)[0].shape == (90, 5)
    assert accuracy(gpc, H_TEST, LABELS_TEST) > 0.95


def kernel_parameters(gpc):
    """Outputscale and lengthscale (2, C) of each class's kernel."""
    kernel = gpc._prior.covariance
    return np.stack([kernel.scale_C, kernel.parameter_C])


@pytest.mark.parametrize("kernel", ["rbf", "matern32"])
def test_a_class_without_labels_is_given_the_mean_kernel_of_the_others(kernel):
    gpc = fitted_without_overlap(replace(QUICK, kernel=kernel))
    before = kernel_parameters(gpc)
    gpc.level()
    after = kernel_parameters(gpc)
    mean = np.sqrt(before[:, 0] * before[:, 1])
    assert np.abs(before[:, 2] / mean - 1).max() > 0.1
    assert after[:, 2] == pytest.approx(mean, rel=1e-5)
    assert after[:, :2] == pytest.approx(before[:, :2], rel=1e-5)


def test_the_kernel_of_an_added_class_is_the_mean_of_the_others_and_leveling_changes_none_with_labels(gpc):
    leveled, grown = copy(gpc), copy(gpc)
    leveled.level()
    grown.grow("blur")
    before, after = kernel_parameters(gpc), kernel_parameters(grown)
    assert kernel_parameters(leveled) == pytest.approx(before, rel=1e-5)
    assert after[:, :3] == pytest.approx(before, rel=1e-5)
    assert after[:, 3] == pytest.approx(before.prod(axis=1) ** (1 / 3), rel=1e-5)


def test_inducing_inputs_lie_around_the_embeddings_named():
    def nearest_centers(gpc):
        inducing = gpc._prior.inducing_M_d * gpc._scaler.scale_d + gpc._scaler.mean_d
        return np.linalg.norm(inducing[:, None] - CENTERS, axis=2).argmin(axis=1)

    of_labeled = GPC(CLASSES, QUICK, "blobs", 0).fit(H[SEEN], LABELS[SEEN])
    assert set(nearest_centers(of_labeled)) == {0, 1}
    assert set(nearest_centers(fitted_without_overlap())) == {0, 1, 2}


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_it_is_that_of_scikit_learn_to_the_last_digit(precision):
    random = np.random.default_rng(0)
    h_N_d = (random.normal(size=(200, 9)) * 10 ** random.uniform(-3, 3, 9)).astype(precision)
    h_N_d[:, 4] = 7  # has no deviation
    scaled = Standardization.of(h_N_d[:100])(h_N_d)
    expected = StandardScaler().fit(h_N_d[:100]).transform(h_N_d)
    assert scaled.dtype == expected.dtype == precision
    assert scaled.tobytes() == expected.tobytes()
