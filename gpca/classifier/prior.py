"""The prior of a fitted sparse GP classifier: covariances and inducing inputs, and the projection of inputs."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, field

import gpytorch
import numpy as np
import torch
from linear_operator.utils.cholesky import psd_safe_cholesky
from scipy.linalg import solve_triangular

from gpca.classifier.covariances import cross_covariance, variance
from gpca.classifier.latents import Projection
from gpca.classifier.sparse_gp import JITTER, SparseGPs


@dataclass(frozen=True)
class Prior:
    """C covariances over shared inducing inputs, fixed from here on.

    Attributes:
        covariance: a ``ScaleKernel`` of batch shape (C,).
        inducing_M_d: shared inducing inputs Z, standardized.
    """

    covariance: gpytorch.kernels.ScaleKernel
    inducing_M_d: torch.Tensor
    _cholesky_C_M_M: np.ndarray = field(init=False, repr=False)

    @classmethod
    def of(cls, model: SparseGPs) -> Prior:
        """Take covariance and inducing inputs from a trained model, detached from it."""
        return cls(deepcopy(model.covariance).requires_grad_(False), model.inducing_M_d.detach().clone())

    def __post_init__(self) -> None:
        with torch.no_grad():
            K_C_M_M = cross_covariance(self.covariance, self.inducing_M_d, self.inducing_M_d)
            cholesky_C_M_M = psd_safe_cholesky((K_C_M_M + JITTER * torch.eye(len(self.inducing_M_d))).double())
        object.__setattr__(self, "_cholesky_C_M_M", cholesky_C_M_M.numpy())

    def project(self, inputs_N_d: torch.Tensor) -> Projection:
        """Return weights L⁻¹ k(Z, x) and residual variance k(x, x) - |weights|² of standardized inputs."""
        with torch.no_grad():
            K_C_M_N = cross_covariance(self.covariance, self.inducing_M_d, inputs_N_d).double().numpy()
            variance_C_N = variance(self.covariance, inputs_N_d).double().numpy() + JITTER
        weights_C_M_N = np.stack(
            [solve_triangular(L, K, lower=True) for L, K in zip(self._cholesky_C_M_M, K_C_M_N, strict=True)]
        )
        residual_C_N = variance_C_N - np.square(weights_C_M_N).sum(axis=1)
        return Projection(inputs_N_d.numpy(), np.swapaxes(weights_C_M_N, 1, 2), np.maximum(residual_C_N, 0))

    def means(self, inputs_N_d: torch.Tensor, mean_C_M: np.ndarray) -> torch.Tensor:
        """Return the means (N, C) of the latents at standardized inputs, differentiable in these, in float64.

        Args:
            inputs_N_d: the inputs.
            mean_C_M: of the whitened inducing values.
        """
        weights_C_M = np.stack([solve_triangular(L.T, m) for L, m in zip(self._cholesky_C_M_M, mean_C_M, strict=True)])
        K_C_M_N = cross_covariance(self.covariance, self.inducing_M_d.double(), inputs_N_d.double())
        return torch.einsum("cmn,cm->nc", K_C_M_N, torch.from_numpy(weights_C_M))

    def grow(self) -> Prior:
        """Return the prior with one more covariance, its parameters the geometric means of the others'."""
        return self._with_parameters(lambda values_C: torch.cat([values_C, _geometric_mean(values_C)]))

    def level(self, known_C: np.ndarray) -> Prior:
        """Return the prior in which the covariances of unknown classes have the geometric means of the known ones'.

        Without a label, a class's covariance has learned only how best to be wrong.
        """
        is_known_C = torch.from_numpy(known_C)

        def with_known_mean(values_C: torch.Tensor) -> torch.Tensor:
            values_C = values_C.clone()
            values_C[~is_known_C] = _geometric_mean(values_C[is_known_C])
            return values_C

        return self._with_parameters(with_known_mean)

    def _with_parameters(self, change) -> Prior:
        """Return the prior with each covariance parameter (C, …), as it acts, replaced by `change` of it."""
        covariance = deepcopy(self.covariance)
        for part in (covariance, covariance.base_kernel):
            for name, raw_C in list(part.named_parameters(recurse=False)):
                constraint = part.constraint_for_parameter_name(name)
                raw_C = constraint.inverse_transform(change(constraint.transform(raw_C)))
                setattr(part, name, torch.nn.Parameter(raw_C, requires_grad=False))
                part.batch_shape = raw_C.shape[:1]
        return Prior(covariance, self.inducing_M_d)


def _geometric_mean(values_C: torch.Tensor) -> torch.Tensor:
    return values_C.log().mean(dim=0, keepdim=True).exp()
