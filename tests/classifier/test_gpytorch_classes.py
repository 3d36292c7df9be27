"""gpytorch's own classes give the numbers of the suite's form, within what docs/baselines.md says."""

from dataclasses import replace

import gpytorch
import numpy as np
import pytest
import torch

from gpca.classifier.gpc import GPC
from gpca.classifier.gpytorch_classes import GpytorchGPC, SameRoots
from gpca.classifier.prior import COVARIANCES
from gpca.classifier.settings import GPCSettings
from gpca.errors import InputError
from gpca.portable import square_root
from tests.vendor_guard import VendorGuard

CLASSES = ("noise", "pose", "overlap")
SCORE, LATENT, BOUND = 1e-4, 5e-4, 1e-4  # largest differences of a score, of a latent's mean or deviation, of the ELBO


def blobs(n, seed, width=16):
    centers = 1.5 * np.random.default_rng(0).normal(size=(3, width))
    blob = np.arange(n) % 3
    h_N_d = centers[blob] + np.random.default_rng(seed).normal(size=(n, width))
    return h_N_d.astype(np.float32), np.array(CLASSES)[blob]


H, LABELS = blobs(60, seed=1)
H_TEST, _ = blobs(30, seed=2)


def pair(kernel="rbf", iterations=40, seed=0, h=H, labels=LABELS):
    """The suite's form and gpytorch's, fitted alike."""
    settings = GPCSettings(kernel, learning_rate=0.05, iterations=iterations, inducing=12, draws=200)
    return [form(CLASSES, settings, "blobs", seed).fit(h, labels) for form in (GPC, GpytorchGPC)]


@pytest.mark.parametrize("kernel", COVARIANCES)
def test_both_forms_give_the_same_numbers(kernel):
    ours, theirs = pair(kernel)
    for own, other in zip(ours.posterior(H_TEST), theirs.posterior(H_TEST), strict=True):
        assert np.abs(own - other).max() < LATENT
    for own, other in zip(ours.attribute(H_TEST), theirs.attribute(H_TEST), strict=True):
        assert own.shape == other.shape
        assert np.abs(own - other).max() < SCORE
    assert theirs.elbo() == pytest.approx(ours.elbo(), abs=BOUND)


def test_another_seed_gives_other_numbers_by_far():
    (_, one), (_, other) = pair(seed=0), pair(seed=1)
    assert np.abs(one.attribute(H_TEST)[0] - other.attribute(H_TEST)[0]).max() > 10 * SCORE


def test_the_classes_are_gpytorchs_own():
    _, theirs = pair(iterations=1)
    strategy, of_one = theirs._model.variational_strategy, theirs._model.variational_strategy.base_variational_strategy
    assert isinstance(theirs._model, gpytorch.models.ApproximateGP)
    assert type(strategy) is gpytorch.variational.IndependentMultitaskVariationalStrategy
    assert type(of_one) is gpytorch.variational.VariationalStrategy
    assert type(of_one._variational_distribution) is gpytorch.variational.CholeskyVariationalDistribution


def test_on_the_way_it_is_what_fewer_iterations_make_it():
    settings = GPCSettings(learning_rate=0.05, iterations=9, inducing=12, draws=50)
    longer = GpytorchGPC(CLASSES, settings, "blobs", 0)
    for done in longer.fit_up_to([4, 9], H, LABELS):
        torch.rand(3)  # a draw of someone else's
        stopped = GpytorchGPC(CLASSES, replace(settings, iterations=done), "blobs", 0).fit(H, LABELS)
        for expected, on_the_way in zip(stopped.attribute(H_TEST), longer.attribute(H_TEST), strict=True):
            assert expected.tobytes() == on_the_way.tobytes()
    assert done == 9


def test_as_many_questions_as_classes_are_answered_one_by_one_and_as_many_samples_are_refused():
    before = torch.random.get_rng_state()
    ours, theirs = pair(iterations=5)
    assert torch.equal(torch.random.get_rng_state(), before)
    for n in (1, 3, 7):
        for own, other in zip(ours.posterior(H_TEST[:n]), theirs.posterior(H_TEST[:n]), strict=True):
            assert np.abs(own - other).max() < LATENT
    with pytest.raises(InputError, match=r"3 samples for 3 classes, .* transposed; give more samples"):
        pair(h=H[:3], labels=LABELS[:3])


@pytest.mark.parametrize("kernel", COVARIANCES)
def test_no_rounding_is_left_to_the_processors_vendor(kernel):
    settings = GPCSettings(kernel, iterations=3, inducing=12, draws=20)
    gpc = GpytorchGPC(CLASSES, settings, "blobs", 0)
    with VendorGuard() as guard:
        gpc.fit(H, LABELS).attribute(H_TEST)
        gpc.elbo()
    assert guard.calls == set()


def test_roots_are_the_elementary_ones_with_torchs_derivative():
    positive = torch.tensor([1e-30, 0.3, 2.0, 1e6], requires_grad=True)
    with SameRoots():
        roots = [positive.sqrt(), torch.sqrt(positive), (1 * positive).sqrt_()]
    for root in roots:
        assert torch.equal(root, square_root(positive))
        (gradient,) = torch.autograd.grad(root.sum(), positive)
        assert torch.allclose(gradient, 0.5 / positive.detach().sqrt(), rtol=1e-5)


def test_distances_are_torchs_with_a_derivative_where_points_coincide():
    points = torch.from_numpy(H[:7]).requires_grad_()
    expected = torch.cdist(points, points[[0, 3]])
    with SameRoots():
        distances = torch.cdist(points, points[[0, 3]])
    assert torch.allclose(distances, expected, atol=1e-2)  # of coinciding points the rounding shows
    apart = [each[[1, 2, 4, 5, 6]].sum() for each in (distances, expected)]
    gradients = [torch.autograd.grad(each, points, retain_graph=True)[0] for each in apart]
    assert torch.allclose(*gradients, atol=1e-4)
    assert torch.isfinite(torch.autograd.grad(distances.sum(), points)[0]).all()
