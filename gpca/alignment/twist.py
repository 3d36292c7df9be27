"""Twists ξ = (rotation, translation) of rigid motions and the maps between them: exp and log of SE(3)."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation


def exp(xi_n_6: np.ndarray) -> np.ndarray:
    """Return the rigid motions (n, 4, 4) of twists (n, 6) in radians and units of length."""
    T_n = np.tile(np.eye(4), (len(xi_n_6), 1, 1))
    T_n[:, :3, :3] = Rotation.from_rotvec(xi_n_6[:, :3]).as_matrix()
    T_n[:, :3, 3] = np.einsum("nij,nj->ni", _left_jacobian(xi_n_6[:, :3]), xi_n_6[:, 3:])
    return T_n


def log(T_n: np.ndarray) -> np.ndarray:
    """Return the twists (n, 6) of rigid motions (n, 4, 4), rotations in (-π, π]."""
    rotation_n_3 = Rotation.from_matrix(T_n[:, :3, :3]).as_rotvec()
    translation_n_3 = np.linalg.solve(_left_jacobian(rotation_n_3), T_n[:, :3, 3, None])[..., 0]
    return np.concatenate([rotation_n_3, translation_n_3], axis=1)


def _left_jacobian(rotation_n_3: np.ndarray) -> np.ndarray:
    """Return J = I + (1 - cos θ)/θ² [ω] + (θ - sin θ)/θ³ [ω]² (Barfoot 2017, Eq. 7.37)."""
    theta_n = np.linalg.norm(rotation_n_3, axis=1)
    small_n = theta_n < 1e-4
    theta = np.where(small_n, 1.0, theta_n)
    a_n = np.where(small_n, 0.5 - theta_n**2 / 24, (1 - np.cos(theta)) / theta**2)
    b_n = np.where(small_n, 1 / 6 - theta_n**2 / 120, (theta - np.sin(theta)) / theta**3)
    cross_n = np.zeros((len(rotation_n_3), 3, 3))
    x, y, z = rotation_n_3.T
    cross_n[:, 0, 1], cross_n[:, 0, 2], cross_n[:, 1, 2] = -z, y, -x
    cross_n[:, 1, 0], cross_n[:, 2, 0], cross_n[:, 2, 1] = z, -y, x
    return np.eye(3) + a_n[:, None, None] * cross_n + b_n[:, None, None] * (cross_n @ cross_n)
