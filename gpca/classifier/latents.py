"""The whitened posterior over a sparse GP classifier's latents, and its update by labels, in numpy.

Kernel and inducing inputs Z are fixed. With K_ZZ = L Lᵀ and u = L v, the prior of v is N(0, I) and each latent is
f(x) = w(x)ᵀ v + r with w(x) = L⁻¹ k(Z, x) and r ~ N(0, k(x, x) - |w(x)|²) (Hensman et al. 2015). Inputs enter only
through w and the variance of r, computed once.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.special import log_softmax, softmax

STEP = 0.5  # toward new sites, of their refinement


@dataclass(frozen=True)
class Projection:
    """N inputs as seen by C latent GPs: weights w on the inducing values, variance of the residual r."""

    inputs_N_d: np.ndarray
    weights_C_N_M: np.ndarray
    residual_C_N: np.ndarray

    def __len__(self) -> int:
        return self.residual_C_N.shape[1]

    def __getitem__(self, rows: np.ndarray | slice | list[int]) -> Projection:
        return Projection(self.inputs_N_d[rows], self.weights_C_N_M[:, rows], self.residual_C_N[:, rows])

    def followed_by(self, other: Projection) -> Projection:
        """Concatenate two projections."""
        return Projection(
            np.concatenate([self.inputs_N_d, other.inputs_N_d]),
            np.concatenate([self.weights_C_N_M, other.weights_C_N_M], axis=1),
            np.concatenate([self.residual_C_N, other.residual_C_N], axis=1),
        )


@dataclass(frozen=True)
class Latents:
    """q(v_c) = N(mean (C, M), covariance (C, M, M)) of the whitened inducing values."""

    mean_C_M: np.ndarray
    covariance_C_M_M: np.ndarray

    def marginals(self, projection: Projection) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and standard deviation (N, C) of the independent latents at N inputs."""
        weights_C_N_M = projection.weights_C_N_M
        mean_C_N = np.einsum("cnm,cm->cn", weights_C_N_M, self.mean_C_M)
        spread_C_N = np.einsum("cnm,cnm->cn", weights_C_N_M @ self.covariance_C_M_M, weights_C_N_M)
        return mean_C_N.T, np.sqrt(np.maximum(spread_C_N + projection.residual_C_N, 0)).T

    def divergence(self) -> float:
        """Return KL(q(v) ‖ N(0, I)) in nats."""
        _, log_determinants = np.linalg.slogdet(self.covariance_C_M_M)
        traces = np.trace(self.covariance_C_M_M, axis1=1, axis2=2)
        squares = np.square(self.mean_C_M).sum(axis=1)
        return 0.5 * float((traces + squares - self.mean_C_M.shape[1] - log_determinants).sum())


@dataclass(frozen=True)
class Sites:
    """Factors of labels: q(v) ∝ N(0, I) Π_n exp(linear_n f_n - precision_n f_n² / 2); zeros are no evidence."""

    linear_N_C: np.ndarray
    precision_N_C: np.ndarray

    @classmethod
    def silent(cls, n: int, n_classes: int) -> Sites:
        """Return sites of zeros: the posterior is the prior."""
        return cls(np.zeros((n, n_classes)), np.zeros((n, n_classes)))

    def extend(self, n: int, n_classes: int) -> Sites:
        """Append silent sites for new inputs and classes."""
        grown = ((0, n - len(self.linear_N_C)), (0, n_classes - self.linear_N_C.shape[1]))
        return Sites(np.pad(self.linear_N_C, grown), np.pad(self.precision_N_C, grown))

    def posterior(self, projection: Projection) -> Latents:
        """Return q(v), exact for Gaussian factors on a Gaussian prior."""
        weights_C_N_M = projection.weights_C_N_M
        weighted_C_M_N = np.swapaxes(weights_C_N_M * self.precision_N_C.T[:, :, None], 1, 2)
        covariance_C_M_M = np.linalg.inv(np.eye(weights_C_N_M.shape[2]) + weighted_C_M_N @ weights_C_N_M)
        linear_C_M = np.einsum("cnm,nc->cm", weights_C_N_M, self.linear_N_C)
        return Latents(np.einsum("cmk,ck->cm", covariance_C_M_M, linear_C_M), covariance_C_M_M)


def refine(
    projection: Projection, targets_N: np.ndarray, sites: Sites, iterations: int, tolerance: float
) -> tuple[Sites, Latents, int]:
    """Maximize the ELBO of the softmax likelihood by natural gradients; each iteration passes once over all labels.

    Conjugate-computation variational inference (Khan & Lin 2017): a step toward the sites with precision
    E_q[p_c (1 - p_c)] and mean gradient E_q[1{y = c} - p_c]. Returns sites, their posterior, and the iterations done.
    """
    wanted_N_C = np.eye(sites.linear_N_C.shape[1])[targets_N]
    latents, normal_Q_1_C = sites.posterior(projection), _normal_points(wanted_N_C.shape[1])[:, None]
    before_N_C = None
    for iteration in range(1, iterations + 1):
        mean_N_C, deviation_N_C = latents.marginals(projection)
        p_Q_N_C = softmax(mean_N_C + deviation_N_C * normal_Q_1_C, axis=2)
        p_N_C = p_Q_N_C.mean(axis=0)
        if before_N_C is not None and np.abs(p_N_C - before_N_C).max() < tolerance:
            return sites, latents, iteration - 1
        curvature_N_C = p_N_C - np.square(p_Q_N_C).mean(axis=0)
        linear_N_C = wanted_N_C - p_N_C + curvature_N_C * mean_N_C
        linear_N_C = (1 - STEP) * sites.linear_N_C + STEP * linear_N_C
        sites = Sites(linear_N_C, (1 - STEP) * sites.precision_N_C + STEP * curvature_N_C)
        latents, before_N_C = sites.posterior(projection), p_N_C
    return sites, latents, iterations


def elbo(projection: Projection, targets_N: np.ndarray, latents: Latents) -> float:
    """Return the evidence lower bound in nats: Σ E_q[log softmax(f)_y] - KL(q ‖ prior)."""
    return expected_log_likelihood(*latents.marginals(projection), targets_N) - latents.divergence()


def expected_log_likelihood(mean_N_C: np.ndarray, deviation_N_C: np.ndarray, targets_N: np.ndarray) -> float:
    """Return Σ E_q[log softmax(f)_y] in nats for independent latents with these marginals."""
    log_p_Q_N_C = log_softmax(mean_N_C + deviation_N_C * _normal_points(mean_N_C.shape[1])[:, None], axis=2)
    return float(log_p_Q_N_C[:, np.arange(len(targets_N)), targets_N].mean(axis=0).sum())


@cache
def _normal_points(n_classes: int) -> np.ndarray:
    """64 standard normal points (Q, C) from a fixed scrambled Sobol sequence."""
    from scipy.stats import norm, qmc

    return norm.ppf(qmc.Sobol(n_classes, rng=0).random_base2(6))
