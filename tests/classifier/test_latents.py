from copy import copy

import numpy as np
import pytest
import torch
from scipy.special import log_softmax, softmax
from scipy.stats import norm, qmc
from torch.distributions import MultivariateNormal, kl_divergence

from gpca.classifier.gpc import GPC
from gpca.classifier.gpytorch_classes import LatentGPs, gpytorch_kernel
from gpca.classifier.latents import Projection, Sites, elbo, refine
from gpca.classifier.settings import GPCSettings
from gpca.classifier.sparse_gp import SparseGPs

CLASSES = ("noise", "pose", "overlap")
QUICK = GPCSettings(learning_rate=0.05, iterations=40, inducing=12, draws=200)
MANY_POINTS_C = norm.ppf(qmc.Sobol(3, rng=5).random_base2(12))  # for expectations, computed independently


def blobs(n, seed):
    centers = 3 * np.random.default_rng(0).normal(size=(3, 16))
    blob = np.arange(n) % 3
    return centers[blob] + np.random.default_rng(seed).normal(size=(n, 16)), blob


H, TARGETS = blobs(60, seed=1)
H_TEST, TARGETS_TEST = blobs(30, seed=2)
LABELS, LABELS_TEST = np.array(CLASSES)[TARGETS], np.array(CLASSES)[TARGETS_TEST]


@pytest.fixture(scope="module")
def trained():
    """A GPC as its fit left it, and gpytorch's model with the same parameters."""
    models = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SparseGPs, "prior", lambda model, prior=SparseGPs.prior: models.append(model) or prior(model))
        gpc = GPC(CLASSES, QUICK, "blobs", 0).fit(H, LABELS)
    (model,) = models
    reference = LatentGPs(gpytorch_kernel(model.covariance.learned()), model.inducing_M_d.detach())
    strategy = reference.variational_strategy.base_variational_strategy
    strategy.variational_params_initialized.fill_(1)  # or gpytorch would set them to the prior's
    distribution = strategy._variational_distribution
    with torch.no_grad():
        distribution.variational_mean.copy_(model.mean_C_M)
        distribution.chol_variational_covar.copy_(model.root_C_M_M)
    return gpc, reference.eval()


@pytest.fixture(scope="module")
def projection(trained):
    return trained[0].project(H)


def refined(projection, targets=TARGETS, sites=None, tolerance=1e-9):
    sites = Sites.silent(len(targets), 3) if sites is None else sites
    sites, latents, _ = refine(projection, targets, sites, iterations=500, tolerance=tolerance)
    return sites, latents


@pytest.fixture(scope="module")
def best(projection):
    return refined(projection)


def expectation(latents, projection, function):
    mean_N_C, deviation_N_C = latents.marginals(projection)
    return np.mean(function(mean_N_C + deviation_N_C * MANY_POINTS_C[:, None]), axis=0)


def precise_elbo(latents, projection):
    log_p_N_C = expectation(latents, projection, lambda logits: log_softmax(logits, axis=2))
    return log_p_N_C[np.arange(len(TARGETS)), TARGETS].sum() - torch_divergence(latents)


def torch_divergence(latents):
    mean, covariance = (torch.from_numpy(array) for array in (latents.mean_C_M, latents.covariance_C_M_M))
    prior = MultivariateNormal(torch.zeros_like(mean), torch.eye(mean.shape[1], dtype=mean.dtype))
    return float(kl_divergence(MultivariateNormal(mean, covariance), prior).sum())


def assert_equal_posterior(one, other, tolerance):
    assert np.abs(one.mean_C_M - other.mean_C_M).max() < tolerance
    assert np.abs(one.covariance_C_M_M - other.covariance_C_M_M).max() < tolerance


@pytest.mark.parametrize("n", [1, 3, 7])
def test_the_marginals_are_those_of_gpytorchs_model(trained, n):
    gpc, model = trained
    with torch.no_grad():
        expected = model(torch.from_numpy(gpc._scaler.single(H_TEST[:n])))
    mean, deviation = gpc.posterior(H_TEST[:n])
    assert mean.shape == (n, 3)
    assert np.abs(mean - expected.mean.numpy()).max() < 1e-4
    assert np.abs(deviation - expected.stddev.numpy()).max() < 1e-4


def test_far_from_the_inducing_inputs_the_marginals_are_the_prior(trained):
    gpc, model = trained
    mean, deviation = gpc.posterior(H_TEST + 1e4)
    assert np.abs(mean).max() < 1e-6
    assert deviation == pytest.approx(np.tile(model.covar_module.outputscale.detach().sqrt(), (30, 1)), rel=1e-3)


def test_the_elbo_is_that_of_many_more_points_and_not_below_that_which_adam_reached(trained, projection, best):
    reached = elbo(projection, TARGETS, best[1])
    assert reached >= elbo(projection, TARGETS, trained[0]._latents)
    assert reached == pytest.approx(precise_elbo(best[1], projection), abs=0.2)


def test_the_elbo_never_falls_from_one_iteration_to_the_next_and_single_ones_are_those_of_one_call(projection):
    sites = Sites.silent(len(TARGETS), 3)
    bounds = [elbo(projection, TARGETS, sites.posterior(projection))]
    together = refine(projection, TARGETS, sites, iterations=30, tolerance=0.0)
    for _ in range(30):
        sites, latents, done = refine(projection, TARGETS, sites, iterations=1, tolerance=0.0)
        bounds.append(elbo(projection, TARGETS, latents))
    assert np.diff(bounds).min() > -1e-5
    assert bounds[-1] > bounds[0] + 50
    assert (together[2], done) == (30, 1)
    assert_equal_posterior(latents, together[1], 1e-12)


def test_a_warm_start_from_the_best_posterior_ends_at_once_and_a_looser_tolerance_earlier_close_by(projection, best):
    sites, latents, done = refine(projection, TARGETS, best[0], iterations=100, tolerance=1e-5)
    assert done == 1
    assert_equal_posterior(latents, best[1], 1e-5)
    assert np.abs(sites.linear_N_C - best[0].linear_N_C).max() < 1e-6
    _, latents, done = refine(projection, TARGETS, Sites.silent(len(TARGETS), 3), iterations=100, tolerance=1e-3)
    assert done < 30
    assert elbo(projection, TARGETS, latents) == pytest.approx(elbo(projection, TARGETS, best[1]), abs=0.01)


def test_labels_in_two_batches_give_the_posterior_of_one(trained):
    def after(*batches):
        gpc = copy(trained[0])
        for batch in batches:
            gpc.update(H_TEST[batch], LABELS_TEST[batch], iterations=500, tolerance=1e-9)
        return gpc._latents

    first, second = slice(11), slice(11, None)
    at_once = after(slice(None))
    assert_equal_posterior(after(first, second), at_once, 1e-5)
    assert_equal_posterior(after(second, first), at_once, 1e-5)


def test_silent_sites_give_the_prior_and_leave_a_posterior_as_it_was(projection, best):
    prior = Sites.silent(len(TARGETS), 3).posterior(projection)
    assert not prior.mean_C_M.any() and prior.divergence() == 0
    assert (prior.covariance_C_M_M == np.eye(prior.mean_C_M.shape[1])).all()
    sites, latents = best
    twice = projection.followed_by(projection[:5])
    assert_equal_posterior(sites.extend(len(twice), 3).posterior(twice), latents, 1e-12)


def test_the_posterior_of_sites_is_that_of_linear_regression():
    random = np.random.default_rng(0)
    weights_N_M, targets_N, variance_N = random.normal(size=(20, 4)), random.normal(size=20), random.uniform(1, 2, 20)
    sites = Sites((targets_N / variance_N)[:, None], (1 / variance_N)[:, None])
    latents = sites.posterior(Projection(np.zeros((20, 1)), weights_N_M[None], np.zeros((1, 20))))
    # The same by conditioning the Gaussian joint of weights and noisy targets.
    gain_M_N = weights_N_M.T @ np.linalg.inv(weights_N_M @ weights_N_M.T + np.diag(variance_N))
    assert latents.mean_C_M[0] == pytest.approx(gain_M_N @ targets_N)
    assert latents.covariance_C_M_M[0] == pytest.approx(np.eye(4) - gain_M_N @ weights_N_M)


def test_at_the_end_the_natural_gradient_is_zero(projection, best):
    sites, latents = best
    mean_N_C, _ = latents.marginals(projection)
    p_N_C = expectation(latents, projection, lambda logits: softmax(logits, axis=2))
    square_N_C = expectation(latents, projection, lambda logits: np.square(softmax(logits, axis=2)))
    curvature_N_C = p_N_C - square_N_C
    assert np.abs(sites.precision_N_C - curvature_N_C).max() < 0.01
    assert np.abs(sites.linear_N_C - (np.eye(3)[TARGETS] - p_N_C + curvature_N_C * mean_N_C)).max() < 0.02
