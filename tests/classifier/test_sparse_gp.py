import math
from itertools import islice

import numpy as np
import pytest
import torch

from gpca.classifier.gpytorch_classes import LatentGPs, ascend, gpytorch_kernel
from gpca.classifier.prior import COVARIANCES, Covariance, Prior
from gpca.classifier.sparse_gp import LearnedCovariance, SparseGPs, _cholesky
from gpca.errors import InputError

RANDOM = torch.Generator().manual_seed(0)
A, B = torch.randn(7, 12, generator=RANDOM), torch.randn(5, 12, generator=RANDOM)


def unlike(name):
    """Three covariances with parameters of their own."""
    parameter_C = np.array([0.1, 0.7, 2.0] if name == "polynomial" else [2.0, 3.0, 5.0])
    return Covariance(name, np.array([0.5, 1.0, 2.0]), parameter_C)


@pytest.mark.parametrize("name", COVARIANCES)
def test_covariances_and_their_gradients_are_gpytorchs(name):
    ours, theirs = LearnedCovariance(unlike(name)), gpytorch_kernel(unlike(name))
    gradients = []
    for kernel, value in ((ours, ours(A, B)), (theirs, theirs(A, B).to_dense())):
        (value * torch.arange(3.0)[:, None, None]).sum().backward()
        gradients.append([parameter.grad.ravel() for parameter in kernel.parameters()])
    assert torch.allclose(ours(A, B), theirs(A, B).to_dense(), atol=1e-5)
    for own, their in zip(*gradients, strict=True):
        assert torch.allclose(own, their, rtol=1e-3, atol=1e-4)


@pytest.mark.parametrize("name", COVARIANCES)
def test_a_learned_covariance_is_the_same_on_arrays_in_double_precision(name):
    learned = LearnedCovariance(unlike(name))
    covariance, inputs = learned.learned(), (A.double().numpy(), B.double().numpy())
    assert covariance.between(*inputs) == pytest.approx(learned(A, B).detach().numpy(), abs=1e-5)
    assert covariance.scale_C == pytest.approx(unlike(name).scale_C, rel=1e-6)
    assert covariance.parameter_C == pytest.approx(unlike(name).parameter_C, rel=1e-6)


@pytest.mark.parametrize("name", COVARIANCES)
@pytest.mark.parametrize("n", [3, 7])  # as many inputs as latents, and more
def test_the_variance_is_the_covariances_diagonal(name, n):
    learned = LearnedCovariance(unlike(name))
    diagonal = learned(A[:n], A[:n]).diagonal(dim1=1, dim2=2)
    assert learned.variance(A[:n]).shape == (3, n)
    assert torch.allclose(learned.variance(A[:n]), diagonal, atol=1e-5)
    in_double = A[:n].double().numpy()
    diagonal_C_A = np.diagonal(learned.learned().between(in_double, in_double), axis1=1, axis2=2)
    assert learned.learned().variance(in_double) == pytest.approx(diagonal_C_A)


@pytest.mark.parametrize("name", COVARIANCES)
def test_gradients_stay_finite_where_inputs_coincide(name):
    inputs = A[[0, 0, 1]].clone().requires_grad_()
    LearnedCovariance(unlike(name))(inputs, inputs).sum().backward()
    assert torch.isfinite(inputs.grad).all()


def test_the_polynomial_is_that_of_inputs_divided_by_the_root_of_their_number():
    x = torch.ones(1, 400)
    expected = math.log(2) * (1 + math.log(2)) ** 2  # scale and offset start at softplus(0)
    assert LearnedCovariance(Covariance.start("polynomial", 1, 5.0))(x, x).item() == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("worst", [1e-9, 1e-3])
def test_a_covariance_that_rounding_made_indefinite_is_mended_within_limits(worst):
    K_C_M_M = torch.diag(torch.tensor([1.0, -worst])).double()[None]
    if worst == 1e-9:
        assert torch.allclose(_cholesky(K_C_M_M)[0] @ _cholesky(K_C_M_M)[0].mT, K_C_M_M[0], atol=1e-7)
    else:
        with pytest.raises(InputError, match="not positive definite"):
            _cholesky(K_C_M_M)


CENTERS = torch.randn(3, 16, generator=torch.Generator().manual_seed(0))
TARGETS = torch.arange(90) % 3
INPUTS = CENTERS[TARGETS] + 0.7 * torch.randn(90, 16, generator=torch.Generator().manual_seed(1))


def fitted(name, iterations, learning_rate=0.05, inputs=INPUTS, targets=TARGETS):
    model = SparseGPs(Prior(Covariance.start(name, 3, 4.0), inputs[:9].numpy()), torch.Generator().manual_seed(5))
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
        reference = LatentGPs(gpytorch_kernel(Covariance.start(name, 3, 4.0)), INPUTS[:9].clone())
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
    mean_N_C, deviation_N_C = model.latents().marginals(model.prior().project(INPUTS.numpy()))
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
