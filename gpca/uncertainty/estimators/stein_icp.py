"""Stein ICP (Maken, Ramos & Ott 2022): Stein variational gradient descent from the prior to the posterior.

The particles attract each other to where the posterior is high and repel each other by the kernel's slope (Liu & Wang
2016). It models the posterior of the pose given these clouds (RA-L 2022), as Bayesian ICP does.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from gpca.seeds import generator
from gpca.uncertainty.estimators.interface import EstimatorEntry, RegisteredPair
from gpca.uncertainty.estimators.posterior import Posterior

BETA_1, BETA_2, EPSILON = 0.9, 0.999, 1e-8  # Adam's defaults, as the authors take it


def estimate(
    registered: RegisteredPair, particles: int = 100, steps: int = 150, batch: int = 150, learning_rate: float = 0.01
) -> np.ndarray:
    """Return the covariance of the particles; batch and number are the authors'."""
    posterior = Posterior(registered)
    random = generator("stein_icp", registered.pair.seed)
    slope = partial(posterior.slope_of_batch, batch=batch, random=random)
    start_n_6 = posterior.prior_sample(random.normal(size=(particles, 6)))
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


ESTIMATORS = {"stein_icp": EstimatorEntry("Stein ICP (SVGD)", "posterior", estimate)}
