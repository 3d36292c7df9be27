"""Twists ξ = (rotation, translation) of rigid motions and the maps between them: exp and log of SE(3)."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from gpca.alignment.rigid import rigid_motion


def exp(xi_n_6: np.ndarray) -> np.ndarray:
    """Return the rigid motions (n, 4, 4) of twists (n, 6) in radians and units of length."""
    shift_n_3 = np.einsum("nij,nj->ni", _left_jacobian(xi_n_6[:, :3]), xi_n_6[:, 3:])
    return rigid_motion(Rotation.from_rotvec(xi_n_6[:, :3]).as_matrix(), shift_n_3)


def log(T_n: np.ndarray) -> np.ndarray:
    """Return the twists (n, 6) of rigid motions (n, 4, 4), rotations in (-π, π]."""
    rotation_n_3 = Rotation.from_matrix(T_n[:, :3, :3]).as_rotvec()
    translation_n_3 = np.linalg.solve(_left_jacobian(rotation_n_3), T_n[:, :3, 3, None])[..., 0]
    return np.concatenate([rotation_n_3, translation_n_3], axis=1)


def adjoint(T_b_a: np.ndarray) -> np.ndarray:
    """Return Ad (6, 6): a twist ξ on the left in frame a is Ad ξ in frame b, exp(Ad ξ) = T_b_a exp(ξ) T_b_a⁻¹."""
    R, t = T_b_a[:3, :3], T_b_a[:3, 3]
    Ad = np.zeros((6, 6))
    Ad[:3, :3] = Ad[3:, 3:] = R
    Ad[3:, :3] = _cross(t[None])[0] @ R
    return Ad


def point_jacobians(points_N_3: np.ndarray) -> np.ndarray:
    """Return ∂y/∂ξ = [-[y], I] (N, 3, 6): how points move under a twist on the left."""
    jacobians_N_3_6 = np.zeros((len(points_N_3), 3, 6))
    jacobians_N_3_6[:, :, :3] = -_cross(points_N_3)
    jacobians_N_3_6[:, :, 3:] = np.eye(3)
    return jacobians_N_3_6


def _cross(vectors_n_3: np.ndarray) -> np.ndarray:
    """Return [v] (n, 3, 3), with [v] u = v × u."""
    cross_n = np.zeros((len(vectors_n_3), 3, 3))
    x, y, z = vectors_n_3.T
    cross_n[:, 0, 1], cross_n[:, 0, 2], cross_n[:, 1, 2] = -z, y, -x
    cross_n[:, 1, 0], cross_n[:, 2, 0], cross_n[:, 2, 1] = z, -y, x
    return cross_n


def _left_jacobian(rotation_n_3: np.ndarray) -> np.ndarray:
    """Return J = I + (1 - cos θ)/θ² [ω] + (θ - sin θ)/θ³ [ω]² (Barfoot 2017, Eq. 7.37)."""
    theta_n = np.linalg.norm(rotation_n_3, axis=1)
    small_n = theta_n < 1e-4
    theta = np.where(small_n, 1.0, theta_n)
    a_n = np.where(small_n, 0.5 - theta_n**2 / 24, (1 - np.cos(theta)) / theta**2)
    b_n = np.where(small_n, 1 / 6 - theta_n**2 / 120, (theta - np.sin(theta)) / theta**3)
    cross_n = _cross(rotation_n_3)
    return np.eye(3) + a_n[:, None, None] * cross_n + b_n[:, None, None] * (cross_n @ cross_n)
