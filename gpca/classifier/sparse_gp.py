"""Sparse GPs under variational inference: their ELBO for a softmax likelihood, to be maximized by gradients.

gpytorch's objective (``VariationalStrategy``, ``CholeskyVariationalDistribution``, ``SoftmaxLikelihood`` and
``VariationalELBO`` with their defaults), from the same random numbers, in several times less time: distances are
shared by the latents, and nothing is built for sizes that are known. :mod:`gpca.classifier.gpytorch_classes` is that
form, and ``tests/classifier/test_sparse_gp.py`` compares the two.
"""

from __future__ import annotations

import gpytorch
import torch
from linear_operator.utils.cholesky import psd_safe_cholesky
from torch import Tensor, nn

from gpca.classifier.covariances import cross_covariance, variance
from gpca.classifier.latents import Latents
from gpca.elementary import square_root

# gpytorch's in single precision: added to variances of the prior; the least variance of a latent.
JITTER, LEAST_VARIANCE = 1e-4, 1e-6
LIKELIHOOD_DRAWS = 10
MEAN_DEVIATION = 1e-3  # the variational mean starts with this standard deviation


class SparseGPs(nn.Module):
    """C independent GPs with shared inducing inputs, covariances of their own and whitened posteriors N(mean, R Rᵀ).

    Args:
        covariance: a ``ScaleKernel`` of batch shape (C,).
        inducing_M_d: where the inducing inputs start; they are learned too.
        random: it draws the start of the mean and the samples of the likelihood.
    """

    def __init__(self, covariance: gpytorch.kernels.ScaleKernel, inducing_M_d: Tensor, random: torch.Generator) -> None:
        super().__init__()
        shape = (len(covariance.outputscale), len(inducing_M_d))
        self.covariance = covariance
        self.inducing_M_d = nn.Parameter(inducing_M_d.clone())
        self.mean_C_M = nn.Parameter(MEAN_DEVIATION * torch.randn(shape, generator=random))
        self.root_C_M_M = nn.Parameter(torch.eye(shape[1]).repeat(shape[0], 1, 1))  # its lower triangle counts
        self._random = random

    def set_posterior(self, latents: Latents) -> None:
        """Replace the start of the variational parameters by this posterior."""
        with torch.no_grad():
            self.mean_C_M.copy_(torch.from_numpy(latents.mean_C_M))
            self.root_C_M_M.copy_(torch.linalg.cholesky(torch.from_numpy(latents.covariance_C_M_M)))

    def marginals(self, inputs_N_d: Tensor) -> tuple[Tensor, Tensor]:
        """Return mean and variance (C, N) of the latents at standardized inputs."""
        jitter_M_M = JITTER * torch.eye(len(self.inducing_M_d))
        K_C_M_M = cross_covariance(self.covariance, self.inducing_M_d, self.inducing_M_d) + jitter_M_M
        cholesky_C_M_M = psd_safe_cholesky(K_C_M_M.double()).float()
        K_C_M_N = cross_covariance(self.covariance, self.inducing_M_d, inputs_N_d)
        weights_C_M_N = torch.linalg.solve_triangular(cholesky_C_M_M, K_C_M_N, upper=False)
        mean_C_N = (self.mean_C_M[:, None] @ weights_C_M_N)[:, 0]
        spread_C_N = (self.root_C_M_M.tril().mT @ weights_C_M_N).square().sum(dim=1)
        explained_C_N = weights_C_M_N.square().sum(dim=1)
        return mean_C_N, variance(self.covariance, inputs_N_d) + JITTER - explained_C_N + spread_C_N

    def divergence(self) -> Tensor:
        """Return KL(q ‖ N(0, I)) in nats, the sum over the latents."""
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
        # Classes before samples: sums over three neighbors are several times as slow.
        log_p_D_N = logits_D_C_N[:, targets_N, torch.arange(len(targets_N))] - logits_D_C_N.logsumexp(dim=1)
        return (log_p_D_N.mean(dim=0).sum() - self.divergence()) / len(targets_N)

    def latents(self) -> Latents:
        """Return the whitened variational posterior."""
        root_C_M_M = self.root_C_M_M.detach().tril().double()
        return Latents(self.mean_C_M.detach().double().numpy(), (root_C_M_M @ root_C_M_M.mT).numpy())
