"""The posterior of a pose given these clouds, drawn by Bayesian ICP (Langevin dynamics) and by Stein ICP."""

from collections.abc import Callable
from functools import partial

import numpy as np

from gpca.alignment.batched_icp import make_target, pulls
from gpca.alignment.methods.interface import REACH
from gpca.rigid import exp, inverse, log
from gpca.seeds import generator
from gpca.uncertainty.estimators.interface import EstimatorEntry, RegisteredPair

SMALLEST_VARIANCE = 1e-10  # squared diameters: a cloud on itself has residuals of zero


class Posterior:
    """ln p(ξ) = -½ |ξ - ξ₀|² / σ₀² - Σ |r|² / 2σ² over the source's matched points at exp(ξ) T̂, for small twists.

    The prior is the starts' distribution about the initial pose ξ₀; σ² is the variance of a residual's coordinate at
    the pose that was found. `covariance` (6, 6) is that of the Gaussian of its curvature at the pose.
    """

    def __init__(self, registered: RegisteredPair) -> None:
        matches = registered.matches()
        self._source, self._T = registered.pair.source, registered.T_target_source
        self._precision = 1 / max(matches.variance, SMALLEST_VARIANCE)
        self.prior_precision_6 = registered.deviation_6**-2.0
        self.prior_6 = log((registered.pair.T_target_source_init @ inverse(self._T))[None])[0]
        self._target = make_target(registered.pair.target, REACH)
        curvature_6_6 = np.einsum("nik,nil->kl", matches.jacobians, matches.jacobians) * self._precision
        self.covariance = np.linalg.inv(curvature_6_6 + np.diag(self.prior_precision_6))

    def slope_of_batch(self, xi_n_6: np.ndarray, batch: int, random: np.random.Generator) -> np.ndarray:
        """Return :meth:`slope` of so many of the source's points, drawn anew at each call."""
        points = len(self._source)
        return self.slope(xi_n_6, random.choice(points, min(batch, points), replace=False, shuffle=False))

    def slope(self, xi_n_6: np.ndarray, rows: np.ndarray | None = None) -> np.ndarray:
        """Return ∂ ln p/∂ξ (n, 6); of some of the source's points alone, they count for all."""
        points = self._source if rows is None else self._source[rows]
        pulls_n_6, fitness_n, _ = pulls(self._target, points, exp(xi_n_6) @ self._T)
        matched_n = fitness_n * len(self._source)
        of_prior_n_6 = (self.prior_6 - xi_n_6) * self.prior_precision_6
        return of_prior_n_6 - self._precision * matched_n[:, None] * pulls_n_6


def bayesian_icp(
    registered: RegisteredPair,
    chains: int = 8,
    steps: int = 400,
    burn_in: int = 100,
    batch: int = 128,
    step_size: float = 0.1,
) -> np.ndarray:
    """Return the covariance of what chains from the pose visit by SGLD on mini-batches (Maken et al., ICRA 2020)."""
    posterior = Posterior(registered)
    random = generator("bayesian_icp", registered.pair.seed)
    slope = partial(posterior.slope_of_batch, batch=batch, random=random)
    start_n_6 = np.zeros((chains, 6))
    visited = langevin(slope, start_n_6, posterior.covariance, steps, burn_in, step_size, random)
    return np.cov(visited, rowvar=False)


def langevin(
    slope: Callable[[np.ndarray], np.ndarray],
    start_n_6: np.ndarray,
    preconditioner_6_6: np.ndarray,
    steps: int,
    burn_in: int,
    step_size: float,
    random: np.random.Generator,
) -> np.ndarray:
    """Return the twists of n chains after the burn-in, all in one (m, 6): x ← x + ½ε M ∇ln p + √(εM) η."""
    root_6_6 = np.linalg.cholesky(preconditioner_6_6)
    x_n_6, visited = start_n_6.copy(), []
    for step in range(steps):
        drift_n_6 = np.einsum("ij,nj->ni", preconditioner_6_6, slope(x_n_6))
        noise_n_6 = np.einsum("ij,nj->ni", root_6_6, random.normal(size=x_n_6.shape))
        x_n_6 = x_n_6 + 0.5 * step_size * drift_n_6 + np.sqrt(step_size) * noise_n_6
        if step >= burn_in:
            visited.append(x_n_6)
    return np.concatenate(visited) if visited else x_n_6


BETA_1, BETA_2, EPSILON = 0.9, 0.999, 1e-8  # Adam's defaults, as the authors take it


def stein_icp(
    registered: RegisteredPair, particles: int = 100, steps: int = 150, batch: int = 150, learning_rate: float = 0.01
) -> np.ndarray:
    """Return the covariance of particles that go from prior to posterior by SVGD (Maken et al., RA-L 2022)."""
    posterior = Posterior(registered)
    random = generator("stein_icp", registered.pair.seed)
    slope = partial(posterior.slope_of_batch, batch=batch, random=random)
    start_n_6 = posterior.prior_6 + random.normal(size=(particles, 6)) / np.sqrt(posterior.prior_precision_6)
    return np.cov(descend(slope, start_n_6, steps, learning_rate), rowvar=False)


def descend(
    slope: Callable[[np.ndarray], np.ndarray], start_n_6: np.ndarray, steps: int, learning_rate: float
) -> np.ndarray:
    """Return where n particles end (n, 6), by Adam with a step that falls to nothing.

    φ(x) = mean over particles x' of k(x', x) ∇ln p(x') + ∇k(x', x), k a Gaussian whose width is the median heuristic's.
    """
    x_n_6, mean_n_6, square_n_6 = start_n_6.copy(), np.zeros_like(start_n_6), np.zeros_like(start_n_6)
    for step in range(1, steps + 1):
        lengths_n = np.square(x_n_6).sum(axis=1)
        squares_n_n = lengths_n[:, None] + lengths_n - 2 * np.einsum("ni,mi->nm", x_n_6, x_n_6)
        width = max(np.median(squares_n_n) / np.log(len(x_n_6) + 1), 1e-12)
        kernel_n_n = np.exp(-squares_n_n / width)
        repelled_n_6 = 2 / width * (kernel_n_n.sum(axis=1)[:, None] * x_n_6 - np.einsum("nm,mi->ni", kernel_n_n, x_n_6))
        phi_n_6 = (np.einsum("nm,mi->ni", kernel_n_n, slope(x_n_6)) + repelled_n_6) / len(x_n_6)
        mean_n_6 = BETA_1 * mean_n_6 + (1 - BETA_1) * phi_n_6
        square_n_6 = BETA_2 * square_n_6 + (1 - BETA_2) * phi_n_6**2
        unbiased_n_6 = mean_n_6 / (1 - BETA_1**step)
        scale_n_6 = np.sqrt(square_n_6 / (1 - BETA_2**step)) + EPSILON
        rate = learning_rate * 0.5 * (1 + np.cos(np.pi * (step - 1) / steps))
        x_n_6 = x_n_6 + rate * unbiased_n_6 / scale_n_6
    return x_n_6


ESTIMATORS = {
    "bayesian_icp": EstimatorEntry("Bayesian ICP (SGLD)", "posterior", bayesian_icp),
    "stein_icp": EstimatorEntry("Stein ICP (SVGD)", "posterior", stein_icp),
}
