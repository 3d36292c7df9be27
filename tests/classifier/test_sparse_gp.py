from itertools import islice

import pytest
import torch

from gpca.classifier.gpytorch_classes import LatentGPs, ascend
from gpca.classifier.sparse_gp import COVARIANCES, Prior, SparseGPs, make_covariance

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
    assert model.divergence().item() == pytest.approx(
        torch.distributions.kl_divergence(q, prior).sum().item(), rel=1e-4
    )


def test_as_many_samples_as_latents_are_not_transposed():
    model, _ = fitted("rbf", 40, inputs=INPUTS[:3], targets=torch.tensor([1, 2, 0]))
    assert model.marginals(INPUTS[:3])[0].argmax(dim=0).tolist() == [1, 2, 0]
