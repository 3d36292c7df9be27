"""Covariances of what the method finds from other initial poses, with the clouds as they are."""

from __future__ import annotations

import numpy as np

from gpca.seeds import generator
from gpca.uncertainty.estimators.interface import EstimatorEntry, RegisteredPair, inverse_hessian


def monte_carlo(registered: RegisteredPair, starts: int = 50) -> np.ndarray:
    """Return Σ = cov(log(T T̂⁻¹)) over the results from random starts, their mean subtracted: it models the starts."""
    return np.cov(sample(registered, starts, "monte_carlo"), rowvar=False)


def sample(registered: RegisteredPair, starts: int, *axes: object) -> np.ndarray:
    """Return the twists (m, 6) of the results from starts that are drawn by the axes."""
    random = generator(*axes, registered.pair.seed)
    return registered.twists_from(random.normal(size=(starts, 6)) * registered.deviation_6)


def brossard(registered: RegisteredPair, noise: float = 0.0, bias: float = 0.0) -> np.ndarray:
    """Return Σ = Σ_unscented + σ² A⁻¹ + b² g gᵀ with g = A⁻¹ Σ Jᵀ (Brossard, Bonnabel & Barrau, RA-L 2020).

    An unscented transform takes the starts' spread through the method by 2·6 sigma points and their middle. The
    sensor's white noise w and a bias b, the same for all points along their normals, move the minimum by
    A⁻¹ Σ Jᵀ (w + b) with A = Σ JᵀJ; the bias remains when there are many points. In diameters, σ is estimated from the
    distances if 0, and b is then as large, as the authors take it.
    """
    distances_n, rows_n_6 = registered.matches().plane_rows()
    variance = noise**2 if noise else np.square(distances_n).sum() / max(len(distances_n) - 6, 1)
    inverse_6_6 = inverse_hessian(np.einsum("ni,nj->ij", rows_n_6, rows_n_6))
    shift_6 = inverse_6_6 @ rows_n_6.sum(axis=0)
    sensor_6_6 = variance * inverse_6_6 + (bias**2 or variance) * np.outer(shift_6, shift_6)
    return unscented(registered) + sensor_6_6


def unscented(registered: RegisteredPair) -> np.ndarray:
    """Return the covariance (6, 6) of the results from starts at ±√6 σ along each axis, about their mean.

    The middle sigma point has no weight, as in a transform of κ = 0; it is the registration itself.
    """
    offsets_6_6 = np.sqrt(6) * np.diag(registered.deviation_6)
    twists_m_6 = registered.twists_from(np.concatenate([offsets_6_6, -offsets_6_6]))
    return np.cov(twists_m_6, rowvar=False, bias=True)


ESTIMATORS = {
    "monte_carlo": EstimatorEntry("Monte-Carlo", "starts", monte_carlo),
    "brossard": EstimatorEntry("Brossard, unscented", "starts and data", brossard),
}
