"""Rigid transforms as 4×4 matrices such as ``T_target_source``, their twists (rotation, translation), least squares."""

import numpy as np
from numpy.typing import ArrayLike

from gpca.errors import InputError
from gpca.numerals import LARGEST_NUMBER


def transform(T_b_a: np.ndarray, points_a: np.ndarray) -> np.ndarray:
    """Map points (..., 3) from frame a to frame b."""
    return rotate(T_b_a, points_a) + T_b_a[:3, 3]


def rotate(T_b_a: np.ndarray, vectors_a: np.ndarray) -> np.ndarray:
    """Rotate vectors (..., 3) from frame a to frame b, by a transform's rotation or a 3×3 matrix."""
    x, y, z = np.moveaxis(vectors_a, -1, 0)  # summed in this order, because a BLAS product's differs by processor
    return np.stack([x * to_x + y * to_y + z * to_z for to_x, to_y, to_z in T_b_a[:3, :3]], axis=-1)


def dots(a_3: np.ndarray, b_3: np.ndarray) -> np.ndarray:
    """Return the products (...,) of vectors (..., 3), summed from x to z on every processor."""
    return a_3[..., 0] * b_3[..., 0] + a_3[..., 1] * b_3[..., 1] + a_3[..., 2] * b_3[..., 2]


def rigid_motion(R_b_a: np.ndarray, translation: ArrayLike = (0.0, 0.0, 0.0)) -> np.ndarray:
    """Return the transforms (..., 4, 4) with these rotations (..., 3, 3) and translations (..., 3)."""
    T_b_a = np.zeros((*R_b_a.shape[:-2], 4, 4))
    T_b_a[..., :3, :3] = R_b_a
    T_b_a[..., :3, 3] = translation
    T_b_a[..., 3, 3] = 1
    return T_b_a


def inverse(T_b_a: np.ndarray) -> np.ndarray:
    """Return ``T_a_b``, by the transpose of the rotation."""
    R_a_b = T_b_a[:3, :3].T
    return rigid_motion(R_a_b, -R_a_b @ T_b_a[:3, 3])


def inverses(T_b_a_n: np.ndarray) -> np.ndarray:
    """Return the inverse of each transform (n, 4, 4)."""
    return np.stack([inverse(T_b_a) for T_b_a in T_b_a_n])


def scale_translation(T_b_a: np.ndarray, factor: float) -> np.ndarray:
    """Multiply the translation by `factor`, for another unit of length."""
    scaled = T_b_a.copy()
    scaled[:3, 3] *= factor
    return scaled


def random_direction(random: np.random.Generator) -> np.ndarray:
    """Return a unit vector (3,) drawn uniformly from the sphere."""
    direction = random.normal(size=3)
    return direction / np.linalg.norm(direction)


def as_rows(T_b_a: np.ndarray, reach: float) -> list[str]:
    """Write a pose, row by row: as many decimals as points at this distance from the origin need, in diameters."""
    decimals = int(np.clip(np.ceil(np.log10(reach)) + 7, 9, 15))
    return [" ".join([*(f"{r:{decimals + 3}.{decimals}f}" for r in row), f"{t:17.9f}"]) for *row, t in T_b_a]


def rotation_angle_rad(T_b_a: np.ndarray) -> float:
    """Return the angle of the rotation, in [0, π]; an arc cosine alone would lose half of the digits near 0 and π."""
    R = T_b_a[:3, :3]
    twice_sine = np.sqrt((R[2, 1] - R[1, 2]) ** 2 + (R[0, 2] - R[2, 0]) ** 2 + (R[1, 0] - R[0, 1]) ** 2)
    return float(np.arctan2(twice_sine, np.trace(R) - 1))


def require_rotation(T_b_a: np.ndarray, subject: object, tolerance: float = 1e-3) -> None:
    """Raise an InputError that names `subject` unless the pose is finite and its upper left part is a rotation."""
    R = T_b_a[:3, :3]
    if not np.isfinite(T_b_a).all():
        fault = "it contains NaN or infinity"
    elif abs(R).max() > 2 or abs(R @ R.T - np.eye(3)).max() > tolerance:
        fault = "its axes are not orthogonal or not of unit length"
    elif np.linalg.det(R) < 0:
        fault = "it is mirrored: its determinant is -1"
    else:
        return
    raise InputError(subject, f"the pose is not a rigid transform: {fault}", "give a proper rotation, row by row")


def require_rigid(T_b_a: np.ndarray, subject: object) -> None:
    """Raise an InputError that names `subject` unless this is a 4×4 rigid transform, last row and all."""
    if T_b_a.shape != (4, 4):
        raise InputError(subject, f"the pose has shape {T_b_a.shape}", "give 4×4 numbers")
    require_rotation(T_b_a, subject)
    if not np.allclose(T_b_a[3], (0, 0, 0, 1), atol=1e-6):
        raise InputError(subject, "the pose is not a rigid transform", "its last row must be 0 0 0 1")
    if (farthest := np.abs(T_b_a[:3, 3]).max()) > LARGEST_NUMBER:
        raise InputError(subject, f"the pose has a translation of {farthest:.3g}", "give it in the unit of the points")


def exp(xi_n_6: np.ndarray) -> np.ndarray:
    """Return the rigid motions (n, 4, 4) of twists (n, 6) in radians and units of length."""
    from scipy.spatial.transform import Rotation

    shift_n_3 = np.einsum("nij,nj->ni", _left_jacobian(xi_n_6[:, :3]), xi_n_6[:, 3:])
    return rigid_motion(Rotation.from_rotvec(xi_n_6[:, :3]).as_matrix(), shift_n_3)


def log(T_n: np.ndarray) -> np.ndarray:
    """Return the twists (n, 6) of rigid motions (n, 4, 4), rotations in (-π, π]."""
    from scipy.spatial.transform import Rotation

    rotation_n_3 = Rotation.from_matrix(T_n[:, :3, :3]).as_rotvec()
    translation_n_3 = np.linalg.solve(_left_jacobian(rotation_n_3), T_n[:, :3, 3, None])[..., 0]
    return np.concatenate([rotation_n_3, translation_n_3], axis=1)


def adjoint(T_b_a: np.ndarray) -> np.ndarray:
    """Return Ad (6, 6), which maps twists on the left from frame a to b: exp(Ad ξ) = T_b_a exp(ξ) T_b_a⁻¹."""
    R = T_b_a[:3, :3]
    return np.block([[R, np.zeros((3, 3))], [_cross(T_b_a[None, :3, 3])[0] @ R, R]])


def point_jacobians(points_N_3: np.ndarray) -> np.ndarray:
    """Return ∂y/∂ξ = [-[y], I] (N, 3, 6) of points moved by a twist on the left."""
    return np.concatenate([-_cross(points_N_3), np.tile(np.eye(3), (len(points_N_3), 1, 1))], axis=2)


def _cross(vectors_n_3: np.ndarray) -> np.ndarray:
    """Return [v] (n, 3, 3), with [v] u = v × u."""
    cross_n, (x, y, z) = np.zeros((len(vectors_n_3), 3, 3)), vectors_n_3.T
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


def best_rotation(source_n_3: np.ndarray, target_n_3: np.ndarray, weights_n: np.ndarray) -> np.ndarray:
    """Return the rotation (3×3) that minimizes Σ w |q - R p|² (Wahba's problem, by Kabsch 1976)."""
    # einsum sums in the same order on every processor; a BLAS product does not.
    u, _, vt = np.linalg.svd(np.einsum("ni,nj->ij", weights_n[:, None] * target_n_3, source_n_3))
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt))])
    return np.einsum("ik,k,kj->ij", u, signs, vt)


def best_motion(source_n_3: np.ndarray, target_n_3: np.ndarray, weights_n: np.ndarray) -> np.ndarray:
    """Return the rigid motion (4×4) that minimizes Σ w |q - T p|²."""
    p_3, q_3 = (np.average(points, axis=0, weights=weights_n) for points in (source_n_3, target_n_3))
    R = best_rotation(source_n_3 - p_3, target_n_3 - q_3, weights_n)
    return rigid_motion(R, q_3 - rotate(R, p_3))


def plane_step(source_n_3: np.ndarray, target_n_3: np.ndarray, normals_n_3: np.ndarray, w_n: np.ndarray) -> np.ndarray:
    """Return one Gauss-Newton step (4×4) of Σ w (nᵀ(q - T p))² from the identity, least norm (Chen & Medioni 1992)."""
    from scipy.spatial.transform import Rotation

    jacobian_n_6 = np.concatenate([np.cross(source_n_3, normals_n_3), normals_n_3], axis=1)
    residuals_n = np.einsum("ni,ni->n", normals_n_3, target_n_3 - source_n_3)
    weighted_n_6 = w_n[:, None] * jacobian_n_6
    hessian_6_6 = np.einsum("ni,nj->ij", weighted_n_6, jacobian_n_6)
    gradient_6 = np.einsum("ni,n->i", weighted_n_6, residuals_n)
    step_6 = np.linalg.lstsq(hessian_6_6, gradient_6, rcond=1e-10)[0]
    # About x, then y, then z, as in Open3D.
    return rigid_motion(Rotation.from_euler("xyz", step_6[:3]).as_matrix(), step_6[3:])
