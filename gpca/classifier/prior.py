"""The fitted prior of the sparse GP classifier, in double precision and without torch."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import get_args

import numpy as np
from scipy.linalg import solve_triangular

from gpca.classifier.latents import Projection
from gpca.classifier.settings import Kernel

COVARIANCES = get_args(Kernel)
JITTER = 1e-4  # added to variances of the prior; gpytorch's in single precision
DEFAULT = math.log(2)  # start of a scale, lengthscale or offset: gpytorch's


@dataclass(frozen=True)
class Covariance:
    """C covariances of one form, with separate scales, and lengthscales or, if polynomial, offsets."""

    form: Kernel
    scale_C: np.ndarray
    parameter_C: np.ndarray

    @classmethod
    def start(cls, form: Kernel, n_classes: int, lengthscale: float = DEFAULT) -> Covariance:
        """Return equal covariances from which a fit starts; the polynomial one has no lengthscale."""
        parameter = DEFAULT if form == "polynomial" else lengthscale
        return cls(form, np.full(n_classes, DEFAULT), np.full(n_classes, parameter))

    def between(self, a_A_d: np.ndarray, b_B_d: np.ndarray) -> np.ndarray:
        """Return k_c(a, b), (C, A, B)."""
        scale_C_1_1, parameter_C_1_1 = self.scale_C[:, None, None], self.parameter_C[:, None, None]
        if self.form == "polynomial":  # divided by d, as plain inner products of some hundred dimensions learn nothing
            return scale_C_1_1 * (a_A_d @ b_B_d.T / a_A_d.shape[1] + parameter_C_1_1) ** 2
        squared_A_B = ((a_A_d * a_A_d).sum(1)[:, None] + (b_B_d * b_B_d).sum(1) - 2 * a_A_d @ b_B_d.T).clip(min=0)
        if self.form == "matern32":
            # As in training, where the root of zero has an infinite derivative.
            scaled_C_A_B = np.sqrt(squared_A_B.clip(min=1e-15)) * (math.sqrt(3) / parameter_C_1_1)
            return scale_C_1_1 * (1 + scaled_C_A_B) * np.exp(-scaled_C_A_B)
        return scale_C_1_1 * np.exp(squared_A_B * (-0.5 / parameter_C_1_1**2))

    def variance(self, a_A_d: np.ndarray) -> np.ndarray:
        """Return k_c(a, a), (C, A)."""
        if self.form == "polynomial":
            return self.scale_C[:, None] * (np.square(a_A_d).mean(axis=1) + self.parameter_C[:, None]) ** 2
        return np.repeat(self.scale_C[:, None], len(a_A_d), axis=1)


@dataclass(frozen=True)
class Prior:
    """The fitted covariances over shared, standardized inducing inputs."""

    covariance: Covariance
    inducing_M_d: np.ndarray  # float32

    @cached_property
    def _cholesky_C_M_M(self) -> np.ndarray:
        inducing_M_d = self.inducing_M_d.astype(np.float64)
        return np.linalg.cholesky(
            self.covariance.between(inducing_M_d, inducing_M_d) + JITTER * np.eye(len(inducing_M_d))
        )

    def project(self, inputs_N_d: np.ndarray) -> Projection:
        """Return weights L⁻¹ k(Z, x) and residual variance k(x, x) - |weights|² of standardized inputs."""
        double_N_d = inputs_N_d.astype(np.float64)
        K_C_M_N = self.covariance.between(self.inducing_M_d.astype(np.float64), double_N_d)
        pairs = zip(self._cholesky_C_M_M, K_C_M_N, strict=True)
        weights_C_M_N = np.stack([solve_triangular(L, K, lower=True) for L, K in pairs])
        residual_C_N = self.covariance.variance(double_N_d) + JITTER - np.square(weights_C_M_N).sum(axis=1)
        return Projection(inputs_N_d, np.swapaxes(weights_C_M_N, 1, 2), np.maximum(residual_C_N, 0))

    def grow(self) -> Prior:
        """Add a covariance whose parameters are the geometric means of the others'."""
        return self._with_parameters(lambda values_C: np.append(values_C, _geometric_mean(values_C)))

    def level(self, labeled_C: np.ndarray) -> Prior:
        """Give covariances of classes without labels, which learned only to be wrong, the means of the others."""
        return self._with_parameters(
            lambda values_C: np.where(labeled_C, values_C, _geometric_mean(values_C[labeled_C]))
        )

    def _with_parameters(self, change: Callable[[np.ndarray], np.ndarray]) -> Prior:
        covariance = self.covariance
        changed = replace(covariance, scale_C=change(covariance.scale_C), parameter_C=change(covariance.parameter_C))
        return Prior(changed, self.inducing_M_d)


def _geometric_mean(values_C: np.ndarray) -> float:
    return float(np.exp(np.log(values_C).mean()))


@dataclass(frozen=True)
class Standardization:
    """Means and deviations (d,) of inputs, 1 for a constant input; the same bits as scikit-learn's, slow to load."""

    mean_d: np.ndarray
    scale_d: np.ndarray

    @classmethod
    def of(cls, h_N_d: np.ndarray) -> Standardization:
        """Fit it to inputs."""
        n, epsilon = len(h_N_d), np.finfo(np.float64).eps
        mean_d = h_N_d.sum(axis=0, dtype=np.float64) / n
        centered_N_d = h_N_d - mean_d
        correction_d = centered_N_d.sum(axis=0)
        variance_d = (np.square(centered_N_d).sum(axis=0) - correction_d**2 / n) / n
        constant_d = variance_d <= n * epsilon * variance_d + (n * mean_d * epsilon) ** 2  # within rounding
        return cls(mean_d, np.where(constant_d, 1.0, np.sqrt(np.maximum(variance_d, 0))))

    def __call__(self, h_N_d: np.ndarray) -> np.ndarray:
        """Return the standardized inputs, in their precision."""
        precision = np.result_type(h_N_d, np.float32)
        return (h_N_d - self.mean_d.astype(precision)) / self.scale_d.astype(precision)

    def single(self, h_N_d: np.ndarray) -> np.ndarray:
        """Return the standardized inputs in single precision."""
        return self(h_N_d).astype(np.float32)
