"""The rigid motion of least squares between corresponding points, and between points and planes."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from gpca.alignment.rigid import rigid_motion, rotate


def best_rotation(source_n_3: np.ndarray, target_n_3: np.ndarray, weights_n: np.ndarray) -> np.ndarray:
    """Return the rotation (3×3) that minimizes Σ w |q - R p|² (Wahba's problem, by Kabsch 1976)."""
    # einsum sums in one order on every processor; a BLAS product does not.
    u, _, vt = np.linalg.svd(np.einsum("ni,nj->ij", weights_n[:, None] * target_n_3, source_n_3))
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt))])
    return np.einsum("ik,k,kj->ij", u, signs, vt)


def best_motion(source_n_3: np.ndarray, target_n_3: np.ndarray, weights_n: np.ndarray) -> np.ndarray:
    """Return the rigid motion (4×4) that minimizes Σ w |q - T p|²."""
    p_3, q_3 = (np.average(points, axis=0, weights=weights_n) for points in (source_n_3, target_n_3))
    R = best_rotation(source_n_3 - p_3, target_n_3 - q_3, weights_n)
    return rigid_motion(R, q_3 - rotate(R, p_3))


def plane_step(
    source_n_3: np.ndarray, target_n_3: np.ndarray, normals_n_3: np.ndarray, weights_n: np.ndarray
) -> np.ndarray:
    """Return one Gauss-Newton step (4×4) of Σ w (nᵀ(q - T p))² from the identity (Chen & Medioni 1992).

    Where planes leave a direction open, such as along a plane, it does not move (the solution of least norm).
    """
    jacobian_n_6 = np.concatenate([np.cross(source_n_3, normals_n_3), normals_n_3], axis=1)
    residuals_n = np.einsum("ni,ni->n", normals_n_3, target_n_3 - source_n_3)
    weighted_n_6 = weights_n[:, None] * jacobian_n_6
    hessian_6_6 = np.einsum("ni,nj->ij", weighted_n_6, jacobian_n_6)
    gradient_6 = np.einsum("ni,n->i", weighted_n_6, residuals_n)
    step_6 = np.linalg.lstsq(hessian_6_6, gradient_6, rcond=1e-10)[0]
    # About x, then y, then z, as Open3D does: to first order the order of small angles does not matter.
    return rigid_motion(Rotation.from_euler("xyz", step_6[:3]).as_matrix(), step_6[3:])
