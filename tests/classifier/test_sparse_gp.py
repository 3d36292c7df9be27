import math
from itertools import islice

import pytest
import torch

from gpca.classifier.gpytorch_classes import LatentGPs, ascend
from gpca.classifier.sparse_gp import COVARIANCES, Prior, SparseGPs, cross_covariance, make_covariance, variance

RANDOM = torch.Generator().manual_seed(0)
A, B = torch.randn(7, 12, generator=RANDOM), torch.randn(5, 12, generator=RANDOM)


def unlike(name):
    """Three kernels with parameters of their own."""
    kernel = make_covariance(name, 3, lengthscale=3.0)
    kernel.outputscale = torch.tensor([0.5, 1.0, 2.0])
    if kernel.base_kernel.has_lengthscale:
        kernel.base_kernel.lengthscale = torch.tensor([2.0, 3.0, 5.0])[:, None, None]
    else:
        kernel.base_kernel.offset = torch.tensor([0.1, 0.7, 2.0])[:, None]
    return kernel


@pytest.mark.parametrize("name", COVARIANCES)
def test_covariances_and_their_gradients_are_gpytorchs(name):
    ours, theirs = unlike(name), unlike(name)
    gradients = []
    for kernel, value in ((ours, cross_covariance(ours, A, B)), (theirs, theirs(A, B).to_dense())):
        (value * torch.arange(3.0)[:, None, None]).sum().backward()
        gradients.append([parameter.grad for parameter in kernel.parameters()])
    assert torch.allclose(cross_covariance(ours, A, B), theirs(A, B).to_dense(), atol=1e-5)
    for own, their in zip(*gradients, strict=True):
        assert torch.allclose(own, their, rtol=1e-3, atol=1e-4)


@pytest.mark.parametrize("name", COVARIANCES)
@pytest.mark.parametrize("n", [3, 7])  # as many inputs as latents, and more
def test_the_variance_is_the_covariances_diagonal(name, n):
    kernel = unlike(name)
    diagonal = cross_covariance(kernel, A[:n], A[:n]).diagonal(dim1=1, dim2=2)
    assert variance(kernel, A[:n]).shape == (3, n)
    assert torch.allclose(variance(kernel, A[:n]), diagonal, atol=1e-5)


@pytest.mark.parametrize("name", COVARIANCES)
def test_gradients_stay_finite_where_inputs_coincide(name):
    inputs = A[[0, 0, 1]].clone().requires_grad_()
    cross_covariance(unlike(name), inputs, inputs).sum().backward()
    assert torch.isfinite(inputs.grad).all()


def test_the_polynomial_is_that_of_inputs_divided_by_the_root_of_their_number():
    kernel = make_covariance("polynomial", 1, lengthscale=1.0)
    x = torch.ones(1, 400)
    expected = kernel.outputscale * (1 + math.log(2)) ** 2  # an offset starts at softplus(0)
    assert cross_covariance(kernel, x, x).item() == pytest.approx(expected.item(), rel=1e-6)


CENTERS = torch.randn(3, 16, generator=torch.Generator().manual_seed(0))
TARGETS = torch.arange(90) % 3
INPUTS = CENTERS[TARGETS] + 0.7 * torch.randn(90, 16, generator=torch.Generator().manual_seed(1))


def fitted(name, iterations, learning_rate=0.05, inputs=INPUTS, targets=TARGETS):
    model = SparseGPs(make_covariance(name, 3, 4.0), inputs[:9], torch.Generator().manual_seed(5))
    optimizer = torch.optim.Adam(model.parameters(), lr=learning_rate)
    losses = []
    for _ in range(iterations):
        optimizer.zero_grad()
        loss = -model.elbo(inputs, targets)
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
    return model, losses


@pytest.mark.parametrize("name", COVARIANCES)
def test_from_the_same_numbers_every_loss_is_gpytorchs(name):
    model, losses = fitted(name, 30)
    with torch.random.fork_rng():
        torch.manual_seed(5)
        reference = LatentGPs(make_covariance(name, 3, 4.0), INPUTS[:9].clone())
        expected = list(islice(ascend(reference, INPUTS, TARGETS, 0.05), 30))
    assert losses == pytest.approx(expected, rel=1e-4)
    assert losses[-1] < losses[0] - 0.1
    mean_C_N, variance_C_N = model.marginals(INPUTS[:20])
    with torch.no_grad():
        latent = reference(INPUTS[:20])
    assert torch.allclose(mean_C_N.T, latent.mean, atol=1e-3)
    assert torch.allclose(variance_C_N.T, latent.variance, atol=1e-3)


@pytest.mark.parametrize("name", COVARIANCES)
def test_prior_and_latents_give_the_marginals_of_the_model(name):
    model, _ = fitted(name, 5)
    mean_N_C, deviation_N_C = model.latents().marginals(Prior.of(model).project(INPUTS))
    mean_C_N, variance_C_N = (part.detach().numpy() for part in model.marginals(INPUTS))
    assert mean_N_C == pytest.approx(mean_C_N.T, abs=1e-3)
    assert deviation_N_C**2 == pytest.approx(variance_C_N.T, abs=1e-3)


def test_the_divergence_is_torchs():
    model, _ = fitted("rbf", 5)
    root_C_M_M = model.root_C_M_M.tril()
    q = torch.distributions.MultivariateNormal(model.mean_C_M, root_C_M_M @ root_C_M_M.mT)
    prior = torch.distributions.MultivariateNormal(torch.zeros(9), torch.eye(9))
    expected = torch.distributions.kl_divergence(q, prior).sum().item()
    assert model.divergence().item() == pytest.approx(expected, rel=1e-4)


def test_as_many_samples_as_latents_are_not_transposed():
    model, _ = fitted("rbf", 40, inputs=INPUTS[:3], targets=torch.tensor([1, 2, 0]))
    assert model.marginals(INPUTS[:3])[0].argmax(dim=0).tolist() == [1, 2, 0]
