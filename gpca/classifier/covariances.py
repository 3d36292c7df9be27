"""Covariances by name (the kernels of the paper): C of one kind, one per latent GP, over the same inputs.

The parameters and their constraints are gpytorch's. The values are computed here, because gpytorch measures the
distances once per latent, although the covariances differ in scale alone; that takes most of the time of a fit.
"""

from __future__ import annotations

import math

import gpytorch
import torch
from torch import Tensor

from gpca.elementary import square_root


class ScaledPolynomial(gpytorch.kernels.PolynomialKernel):
    """The covariance (xᵀx' / d + c)², since nothing is learned from plain inner products of some hundred dimensions."""

    def __init__(self, **options) -> None:
        super().__init__(power=2, **options)

    def forward(self, x1: Tensor, x2: Tensor, **options) -> Tensor:
        """Return the covariance of the inputs."""
        width = math.sqrt(x1.shape[-1])
        return super().forward(x1 / width, x2 / width, **options)


COVARIANCES = {
    "rbf": gpytorch.kernels.RBFKernel,
    "matern32": lambda **options: gpytorch.kernels.MaternKernel(nu=1.5, **options),
    "polynomial": ScaledPolynomial,
}


class Scaled(gpytorch.kernels.ScaleKernel):
    """Scales over a covariance of the same batch shape: no shapes to broadcast, for which torch would load SymPy."""

    @property
    def batch_shape(self) -> torch.Size:
        """Return that of the scales."""
        return self._batch_shape

    @batch_shape.setter
    def batch_shape(self, shape: torch.Size) -> None:
        self._batch_shape = shape


def make_covariance(name: str, n_classes: int, lengthscale: float) -> gpytorch.kernels.ScaleKernel:
    """Return C covariances, each with a scale of its own; the polynomial one has an offset and no lengthscale."""
    batch = torch.Size([n_classes])
    covariance = Scaled(COVARIANCES[name](batch_shape=batch), batch_shape=batch)
    if covariance.base_kernel.has_lengthscale:
        covariance.base_kernel.lengthscale = lengthscale
    return covariance


def cross_covariance(covariance: gpytorch.kernels.ScaleKernel, a_A_d: Tensor, b_B_d: Tensor) -> Tensor:
    """Return k_c(a, b), (C, A, B), of batch shape (C,); gpytorch computes those that have no form here."""
    base = covariance.base_kernel
    scale_C_1_1 = covariance.outputscale[:, None, None]
    if isinstance(base, ScaledPolynomial):
        inner_A_B = a_A_d @ b_B_d.T / a_A_d.shape[1]
        return scale_C_1_1 * (inner_A_B + base.offset[:, :, None]).square()
    squared_A_B = squared_distances(a_A_d, b_B_d)
    if isinstance(base, gpytorch.kernels.MaternKernel):
        # The root of zero has an infinite derivative, so the squares stay above it.
        scaled_C_A_B = square_root(squared_A_B.clamp_min(1e-15)) * (math.sqrt(3) / base.lengthscale)
        return scale_C_1_1 * (1 + scaled_C_A_B) * torch.exp(-scaled_C_A_B)
    if isinstance(base, gpytorch.kernels.RBFKernel):
        return scale_C_1_1 * torch.exp(squared_A_B * (-0.5 / base.lengthscale.square()))
    return covariance(a_A_d, b_B_d).to_dense()


def variance(covariance: gpytorch.kernels.ScaleKernel, a_A_d: Tensor) -> Tensor:
    """Return k_c(a, a), (C, A)."""
    base = covariance.base_kernel
    scale_C_1 = covariance.outputscale[:, None]
    if isinstance(base, ScaledPolynomial):
        return scale_C_1 * (a_A_d.square().mean(dim=1) + base.offset).square()
    if base.is_stationary:
        return scale_C_1.expand(-1, len(a_A_d))
    # Not with diag=True: of as many inputs as latents, gpytorch takes the variances (C, A) for a covariance (A, A).
    return covariance(a_A_d).diagonal(dim1=-1, dim2=-2)


def squared_distances(a_A_d: Tensor, b_B_d: Tensor) -> Tensor:
    """Return |a - b|², (A, B)."""
    squares_A_1, squares_B = a_A_d.square().sum(dim=1, keepdim=True), b_B_d.square().sum(dim=1)
    return torch.addmm(squares_A_1 + squares_B, a_A_d, b_B_d.T, alpha=-2).clamp_min(0)
