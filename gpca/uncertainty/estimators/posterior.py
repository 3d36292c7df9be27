"""The posterior of a pose that Bayesian and Stein ICP draw from, by its slope; matches follow the pose."""

from __future__ import annotations

import numpy as np

from gpca.alignment.methods.interface import CORRESPONDENCE_DISTANCE
from gpca.alignment.rigid import exp, inverse, log
from gpca.uncertainty.estimators.interface import RegisteredPair

SMALLEST_VARIANCE = 1e-10  # squared diameters: a cloud on itself has residuals of zero


class Posterior:
    """ln p(ξ) = -½ |ξ - ξ₀|² / σ₀² - Σ |r|² / 2σ² over the source's matched points at exp(ξ) T̂.

    The prior is the starts' distribution about the initial pose ξ₀; σ² is the variance of a residual's coordinate at
    the pose that was found. Valid for small twists: distances on the group are those of the twists.

    Attributes:
        covariance: (6, 6) of the Gaussian that has its curvature at the pose, for steps of the right size.
        source: (N, 3).
    """

    def __init__(self, registered: RegisteredPair) -> None:
        from gpca.alignment.batched_icp import Pulls

        matches = registered.matches()
        self.source = registered.pair.source
        self._T = registered.T_target_source
        self._precision = 1 / max(matches.variance, SMALLEST_VARIANCE)
        self._prior_precision_6 = registered.deviation_6**-2.0
        self._prior_6 = log((registered.pair.T_target_source_init @ inverse(self._T))[None])[0]
        self._pulls = Pulls(registered.pair.target, CORRESPONDENCE_DISTANCE)
        curvature_6_6 = np.einsum("nik,nil->kl", matches.jacobians, matches.jacobians) * self._precision
        self.covariance = np.linalg.inv(curvature_6_6 + np.diag(self._prior_precision_6))

    def prior_sample(self, normal_n_6: np.ndarray) -> np.ndarray:
        """Return draws (n, 6) of the prior, of standard normal numbers."""
        return self._prior_6 + normal_n_6 / np.sqrt(self._prior_precision_6)

    def slope_of_batch(self, xi_n_6: np.ndarray, batch: int, random: np.random.Generator) -> np.ndarray:
        """Return :meth:`slope` of so many of the source's points, drawn anew at each call."""
        points = len(self.source)
        return self.slope(xi_n_6, random.choice(points, min(batch, points), replace=False, shuffle=False))

    def slope(self, xi_n_6: np.ndarray, rows: np.ndarray | None = None) -> np.ndarray:
        """Return ∂ ln p/∂ξ (n, 6); of some of the source's points alone, they count for all."""
        points = self.source if rows is None else self.source[rows]
        pulls_n_6, fitness_n, _ = self._pulls(points, exp(xi_n_6) @ self._T)
        matched_n = fitness_n * len(self.source)
        of_prior_n_6 = (self._prior_6 - xi_n_6) * self._prior_precision_6
        return of_prior_n_6 - self._precision * matched_n[:, None] * pulls_n_6
