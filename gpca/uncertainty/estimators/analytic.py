"""Covariances of what the method finds from other starts, and in closed form, which model the sensor's noise alone."""

import numpy as np

from gpca.rigid import point_jacobians
from gpca.seeds import generator
from gpca.uncertainty.estimators import interface


def monte_carlo(registered: interface.RegisteredPair, starts: int = 50) -> np.ndarray:
    """Return Σ = cov(log(T T̂⁻¹)) over the results from random starts, their mean subtracted: it models the starts."""
    return np.cov(sample(registered, starts, "monte_carlo"), rowvar=False)


def sample(registered: interface.RegisteredPair, starts: int, *axes: object) -> np.ndarray:
    """Return the twists (m, 6) of the results from starts that are drawn by the axes."""
    random = generator(*axes, registered.pair.seed)
    return registered.twists_from(random.normal(size=(starts, 6)) * registered.deviation_6)


def brossard(registered: interface.RegisteredPair) -> np.ndarray:
    """Return Σ = Σ_unscented + σ² (A⁻¹ + g gᵀ) with g = A⁻¹ Σ Jᵀ (Brossard, Bonnabel & Barrau, RA-L 2020).

    An unscented transform takes the starts' spread through the method by sigma points. The sensor's white noise w and a
    bias b, the same for all points along their normals, move the minimum by A⁻¹ Σ Jᵀ (w + b) with A = Σ JᵀJ; σ is
    estimated from the distances, and b is as large, as the authors take it.
    """
    variance, inverse_6_6, rows_n_6 = plane_fit(registered)
    shift_6 = inverse_6_6 @ rows_n_6.sum(axis=0)
    return unscented(registered) + (variance * inverse_6_6 + variance * np.outer(shift_6, shift_6))


def plane_fit(registered: interface.RegisteredPair) -> tuple[float, np.ndarray, np.ndarray]:
    """Return σ² of the distances from planes, (Σ JᵀJ)⁻¹ (6, 6) and their rows J (n, 6)."""
    distances_n, rows_n_6 = registered.matches().plane_rows()
    variance = np.square(distances_n).sum() / max(len(distances_n) - 6, 1)
    return variance, interface.inverse_hessian(np.einsum("ni,nj->ij", rows_n_6, rows_n_6)), rows_n_6


def unscented(registered: interface.RegisteredPair) -> np.ndarray:
    """Return the covariance (6, 6) of the results from starts at ±√6 σ along each axis (κ = 0), about their mean."""
    offsets_6_6 = np.sqrt(6) * np.diag(registered.deviation_6)
    twists_m_6 = registered.twists_from(np.concatenate([offsets_6_6, -offsets_6_6]))
    return np.cov(twists_m_6, rowvar=False, bias=True)


def bonnabel(registered: interface.RegisteredPair) -> np.ndarray:
    """Return Σ = σ² (Σ JᵀJ)⁻¹ of point-to-plane ICP (Bonnabel, Barczyk & Goulette, ACC 2016)."""
    if registered.method.startswith(interface.POINT_TO_POINT):
        raise interface.FailedEstimate(
            "the Hessian is no covariance of point-to-point, as it leaves out that matches change with the pose; "
            "register by point_to_plane"
        )
    if registered.method != interface.POINT_TO_PLANE:
        raise interface.FailedEstimate(f"the rule is that of point_to_plane, not of '{registered.method}'")
    variance, inverse_6_6, _ = plane_fit(registered)
    return variance * inverse_6_6


def censi(registered: interface.RegisteredPair) -> np.ndarray:
    """Return Σ of point-to-point ICP (Censi, ICRA 2007).

    With A(z, ξ) the cost of the points z at the twist ξ, Σ = H⁻¹ (∂²A/∂z∂ξ) Σ_z (∂²A/∂z∂ξ)ᵀ H⁻¹ with H = ∂²A/∂ξ². It
    leaves out that the matches change with the pose. The residuals, from which Σ_z is, have the noise of both clouds.
    """
    if not registered.method.startswith(interface.POINT_TO_POINT):
        raise interface.FailedEstimate(f"the closed form is that of point-to-point, not of '{registered.method}'")
    matches = registered.matches()
    inverse_6_6 = interface.inverse_hessian(hessian(matches))
    of_source_n_6_3, of_target_n_6_3 = mixed_derivatives(matches)
    middle_6_6 = sum(np.einsum("nij,nkj->ik", of_z, of_z) for of_z in (of_source_n_6_3, of_target_n_6_3))
    return matches.variance / 2 * inverse_6_6 @ middle_6_6 @ inverse_6_6


def hessian(matches: interface.Correspondences) -> np.ndarray:
    """Return H (6, 6) of A = Σ |exp(ξ) y - q|² at ξ = 0, the curvature of the motion included."""
    y, r = matches.source, matches.residuals
    hessian_6_6 = 2 * np.einsum("nik,nil->kl", matches.jacobians, matches.jacobians)
    outer_3_3 = np.einsum("ni,nj->ij", r, y)
    hessian_6_6[:3, :3] += outer_3_3 + outer_3_3.T - 2 * np.trace(outer_3_3) * np.eye(3)
    cross_3_3 = -point_jacobians(r.sum(axis=0)[None])[0, :, :3]
    hessian_6_6[3:, :3] += cross_3_3
    hessian_6_6[:3, 3:] += cross_3_3.T
    return hessian_6_6


def mixed_derivatives(matches: interface.Correspondences) -> tuple[np.ndarray, np.ndarray]:
    """Return ∂²A/∂y∂ξ and ∂²A/∂q∂ξ (n, 6, 3), by the moved source points and by the target's.

    The gradient is 2 Σ (y × r, r) with r = y - q; moving y by a changes y × r by q × a, moving q by b by -y × b.
    """
    of_source_n_6_3 = 2 * np.swapaxes(point_jacobians(matches.target), 1, 2)
    of_target_n_6_3 = -2 * np.swapaxes(point_jacobians(matches.source), 1, 2)
    return of_source_n_6_3, of_target_n_6_3


ESTIMATORS = {
    "bonnabel": interface.EstimatorEntry("Bonnabel, point-to-plane", "data", bonnabel),
    "censi": interface.EstimatorEntry("Censi, closed form", "data", censi),
    "monte_carlo": interface.EstimatorEntry("Monte-Carlo", "starts", monte_carlo),
    "brossard": interface.EstimatorEntry("Brossard, unscented", "starts and data", brossard),
}
