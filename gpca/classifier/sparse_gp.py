"""Sparse GPs under variational inference: gpytorch's objective from the same random numbers, several times faster."""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.functional import softplus

from gpca.classifier.latents import Latents
from gpca.classifier.prior import JITTER, Covariance, Prior
from gpca.classifier.settings import GPCSettings
from gpca.errors import InputError
from gpca.portable import square_root
from gpca.seeds import generator, seed_of

LEAST_VARIANCE = 1e-6  # smallest variance of a latent; gpytorch's in single precision
LIKELIHOOD_DRAWS = 10
MOST_MEDIAN = 1000  # random inputs among which the median distance is taken
MEAN_DEVIATION = 1e-3  # standard deviation of the variational mean at the start
FURTHER_JITTER = (0.0, 1e-8, 1e-7, 1e-6)  # tried in turn: covariances in single precision may not be positive


class LearnedCovariance(nn.Module):
    """A :class:`Covariance` in single precision, each parameter of which is the softplus of a free number."""

    def __init__(self, start: Covariance) -> None:
        super().__init__()
        self.form = start.form
        self.free_scale_C = nn.Parameter(_inverse_softplus(start.scale_C))
        self.free_parameter_C = nn.Parameter(_inverse_softplus(start.parameter_C))

    def forward(self, a_A_d: Tensor, b_B_d: Tensor) -> Tensor:
        """Return k_c(a, b), (C, A, B)."""
        scale_C_1_1 = softplus(self.free_scale_C)[:, None, None]
        parameter_C_1_1 = softplus(self.free_parameter_C[:, None, None])
        if self.form == "polynomial":
            return scale_C_1_1 * (a_A_d @ b_B_d.T / a_A_d.shape[1] + parameter_C_1_1).square()
        squared_A_B = squared_distances(a_A_d, b_B_d)
        if self.form == "matern32":
            # The root of zero has an infinite derivative, so the squares stay above it.
            scaled_C_A_B = square_root(squared_A_B.clamp_min(1e-15)) * (math.sqrt(3) / parameter_C_1_1)
            return scale_C_1_1 * (1 + scaled_C_A_B) * torch.exp(-scaled_C_A_B)
        return scale_C_1_1 * torch.exp(squared_A_B * (-0.5 / parameter_C_1_1.square()))

    def variance(self, a_A_d: Tensor) -> Tensor:
        """Return k_c(a, a), (C, A)."""
        scale_C_1 = softplus(self.free_scale_C)[:, None]
        if self.form == "polynomial":
            return scale_C_1 * (a_A_d.square().mean(dim=1) + softplus(self.free_parameter_C[:, None])).square()
        return scale_C_1.expand(-1, len(a_A_d))

    def learned(self) -> Covariance:
        """Return the covariance as it is now."""
        scale_C, parameter_C = (
            softplus(free_C.detach()).double().numpy() for free_C in (self.free_scale_C, self.free_parameter_C)
        )
        return Covariance(self.form, scale_C, parameter_C)


def _inverse_softplus(values_C: np.ndarray) -> Tensor:
    positive_C = torch.from_numpy(values_C).float()
    return positive_C + torch.log(-torch.expm1(-positive_C))


def squared_distances(a_A_d: Tensor, b_B_d: Tensor) -> Tensor:
    squares_A_1, squares_B = a_A_d.square().sum(dim=1, keepdim=True), b_B_d.square().sum(dim=1)
    return torch.addmm(squares_A_1 + squares_B, a_A_d, b_B_d.T, alpha=-2).clamp_min(0)


class SparseGPs(nn.Module):
    """C independent GPs with shared inducing inputs, separate covariances and whitened posteriors N(mean, R Rᵀ)."""

    def __init__(self, start: Prior, random: torch.Generator) -> None:
        super().__init__()
        shape = (len(start.covariance.scale_C), len(start.inducing_M_d))
        self.covariance = LearnedCovariance(start.covariance)
        self.inducing_M_d = nn.Parameter(torch.from_numpy(start.inducing_M_d).clone())
        self.mean_C_M = nn.Parameter(MEAN_DEVIATION * torch.randn(shape, generator=random))
        self.root_C_M_M = nn.Parameter(torch.eye(shape[1]).repeat(shape[0], 1, 1))  # only its lower triangle is used
        self._random = random

    def set_posterior(self, latents: Latents) -> None:
        """Set the variational parameters to this posterior."""
        with torch.no_grad():
            self.mean_C_M.copy_(torch.from_numpy(latents.mean_C_M))
            self.root_C_M_M.copy_(torch.linalg.cholesky(torch.from_numpy(latents.covariance_C_M_M)))

    def marginals(self, inputs_N_d: Tensor) -> tuple[Tensor, Tensor]:
        """Return mean and variance (C, N) of the latents at standardized inputs."""
        jitter_M_M = JITTER * torch.eye(len(self.inducing_M_d))
        K_C_M_M = self.covariance(self.inducing_M_d, self.inducing_M_d) + jitter_M_M
        cholesky_C_M_M = _cholesky(K_C_M_M.double()).float()
        K_C_M_N = self.covariance(self.inducing_M_d, inputs_N_d)
        weights_C_M_N = torch.linalg.solve_triangular(cholesky_C_M_M, K_C_M_N, upper=False)
        mean_C_N = (self.mean_C_M[:, None] @ weights_C_M_N)[:, 0]
        spread_C_N = (self.root_C_M_M.tril().mT @ weights_C_M_N).square().sum(dim=1)
        explained_C_N = weights_C_M_N.square().sum(dim=1)
        return mean_C_N, self.covariance.variance(inputs_N_d) + JITTER - explained_C_N + spread_C_N

    def divergence(self) -> Tensor:
        """Return KL(q ‖ N(0, I)) in nats, summed over the latents."""
        root_C_M_M = self.root_C_M_M.tril()
        log_determinant = 2 * root_C_M_M.diagonal(dim1=1, dim2=2).abs().log().sum()
        squares = root_C_M_M.square().sum() + self.mean_C_M.square().sum()
        return 0.5 * (squares - self.mean_C_M.numel() - log_determinant)

    def elbo(self, inputs_N_d: Tensor, targets_N: Tensor) -> Tensor:
        """Return the evidence lower bound per sample in nats, its expectation over `LIKELIHOOD_DRAWS` draws."""
        mean_C_N, variance_C_N = self.marginals(inputs_N_d)
        shape = (LIKELIHOOD_DRAWS, len(inputs_N_d), len(mean_C_N))
        normal_D_N_C = torch.randn(shape, generator=self._random)
        deviation_N_C = square_root(variance_C_N.clamp_min(LEAST_VARIANCE)).T
        logits_D_C_N = (mean_C_N.T + deviation_N_C * normal_D_N_C).mT.contiguous()
        # Classes before samples: sums over three neighbors are several times slower.
        log_p_D_N = logits_D_C_N[:, targets_N, torch.arange(len(targets_N))] - logits_D_C_N.logsumexp(dim=1)
        return (log_p_D_N.mean(dim=0).sum() - self.divergence()) / len(targets_N)

    def latents(self) -> Latents:
        """Return the whitened variational posterior."""
        root_C_M_M = self.root_C_M_M.detach().tril().double()
        return Latents(self.mean_C_M.detach().double().numpy(), (root_C_M_M @ root_C_M_M.mT).numpy())

    def prior(self) -> Prior:
        """Return covariances and inducing inputs as they are now."""
        return Prior(self.covariance.learned(), self.inducing_M_d.detach().numpy().copy())


def _cholesky(K_C_M_M: Tensor) -> Tensor:
    for jitter in FURTHER_JITTER:
        factor_C_M_M, info_C = torch.linalg.cholesky_ex(
            K_C_M_M + jitter * torch.eye(K_C_M_M.shape[1]) if jitter else K_C_M_M
        )
        if not info_C.any():
            return factor_C_M_M
    raise InputError("covariance of the classifier", "is not positive definite", "lower its learning rate")


def start_of(inputs_N_d: Tensor, n_classes: int, settings: GPCSettings, axes: tuple) -> Prior:
    """Return the prior from which a fit to standardized inputs starts, with k-means centers; `axes` name the seeds."""
    from sklearn.cluster import KMeans
    from threadpoolctl import threadpool_limits

    # The lengthscale is the median distance: with gpytorch's, an RBF kernel on some hundred dimensions learns nothing.
    order = generator(*axes, "median").permutation(len(inputs_N_d))[:MOST_MEDIAN]
    median = float(torch.pdist(inputs_N_d[order]).median()) if len(order) > 1 else 0.0
    covariance = Covariance.start(settings.kernel, n_classes, median if median > 0 else 1.0)
    clusters = min(settings.inducing, len(torch.unique(inputs_N_d, dim=0)))
    means = KMeans(clusters, n_init=1, random_state=seed_of(*axes, "inducing") % 2**32)
    with threadpool_limits(1):  # several threads add up in any order
        return Prior(covariance, means.fit(inputs_N_d.numpy()).cluster_centers_)
