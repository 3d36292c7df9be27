"""Bayesian ICP (Maken, Ramos & Ott 2020): stochastic gradient Langevin dynamics on mini-batches of the source.

It models the posterior of the pose given these clouds (ICRA 2020). Where the likelihood is right and points are many,
that is as wide as the estimate's distribution over clouds measured again (the theorem of Bernstein and von Mises).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from gpca.seeds import generator
from gpca.uncertainty.estimators.interface import EstimatorEntry, RegisteredPair
from gpca.uncertainty.estimators.posterior import Posterior


def estimate(
    registered: RegisteredPair,
    chains: int = 8,
    steps: int = 400,
    burn_in: int = 100,
    batch: int = 128,
    step_size: float = 0.1,
) -> np.ndarray:
    """Return the covariance of the twists that the chains visit after `burn_in` steps; they begin at the pose."""
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
    """Return the twists of n chains after the burn-in, all in one (m, 6): x ← x + ½ε M ∇ln p + √(εM) η.

    Args:
        slope: ∇ln p (n, 6) at (n, 6), exact or from a mini-batch.
        preconditioner_6_6: M; with the posterior's covariance all directions mix alike.
        step_size: ε; the variance comes out too large by about a quarter of it.
    """
    root_6_6 = np.linalg.cholesky(preconditioner_6_6)
    x_n_6, visited = start_n_6.copy(), []
    for step in range(steps):
        drift_n_6 = np.einsum("ij,nj->ni", preconditioner_6_6, slope(x_n_6))
        noise_n_6 = np.einsum("ij,nj->ni", root_6_6, random.normal(size=x_n_6.shape))
        x_n_6 = x_n_6 + 0.5 * step_size * drift_n_6 + np.sqrt(step_size) * noise_n_6
        if step >= burn_in:
            visited.append(x_n_6)
    return np.concatenate(visited) if visited else x_n_6


ESTIMATORS = {"bayesian_icp": EstimatorEntry("Bayesian ICP (SGLD)", "posterior", estimate)}
