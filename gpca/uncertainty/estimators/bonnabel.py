"""Bonnabel's rule (Bonnabel, Barczyk & Goulette 2016): when the Hessian of least squares gives the covariance.

Between points and planes a match may slide along its plane and costs nothing, so that matches that change do no harm to
Σ = σ² H⁻¹. Between points it makes the pose look held where it is not.

It models the data: the sensor's noise, and that of nothing else (Bonnabel et al., ACC 2016, whose σ² is its variance).
"""

from __future__ import annotations

import numpy as np

from gpca.uncertainty.estimators.interface import (
    POINT_TO_PLANE,
    POINT_TO_POINT,
    EstimatorEntry,
    FailedEstimate,
    RegisteredPair,
    inverse_hessian,
)


def estimate(registered: RegisteredPair, noise: float = 0.0) -> np.ndarray:
    """Return Σ = σ² (Σ JᵀJ)⁻¹ of point-to-plane ICP.

    Args:
        noise: σ, standard deviation of the distances from planes, in diameters; with 0 it is estimated from them.

    Raises:
        FailedEstimate: another method than point-to-plane, no normals, or a singular Hessian.
    """
    if registered.method.startswith(POINT_TO_POINT):
        raise FailedEstimate(
            "the Hessian is no covariance of point-to-point, as it leaves out that matches change with the pose; "
            "register by point_to_plane"
        )
    if registered.method != POINT_TO_PLANE:
        raise FailedEstimate(f"the rule is that of point_to_plane, not of '{registered.method}'")
    distances_n, rows_n_6 = registered.matches().plane_rows()
    variance = noise**2 if noise else np.square(distances_n).sum() / max(len(distances_n) - 6, 1)
    return variance * inverse_hessian(np.einsum("ni,nj->ij", rows_n_6, rows_n_6))


ESTIMATORS = {"bonnabel": EstimatorEntry("Bonnabel, point-to-plane", "data", estimate)}
