"""The motion of least squares between corresponding points, compiled by numba for the loops of ICP."""

from __future__ import annotations

import numpy as np

from gpca.process.compilation import INNER_LOOP, njit


@njit(**INNER_LOOP)
def move(pose, moments, room):
    """Apply the rigid motion of least squares between corresponding points to the pose (Horn 1987, by quaternions)."""
    q0, q1, q2 = moments[0, 3], moments[1, 3], moments[2, 3]
    p0, p1, p2 = moments[3, 0], moments[3, 1], moments[3, 2]
    # Sums of Horn's notation: of the products of the source's first and the target's second coordinate.
    xx, yx, zx = moments[0, 0] - q0 * p0, moments[0, 1] - q0 * p1, moments[0, 2] - q0 * p2
    xy, yy, zy = moments[1, 0] - q1 * p0, moments[1, 1] - q1 * p1, moments[1, 2] - q1 * p2
    xz, yz, zz = moments[2, 0] - q2 * p0, moments[2, 1] - q2 * p1, moments[2, 2] - q2 * p2
    matrix, vectors = room[:4], room[4:]
    matrix[0, 0], matrix[0, 1], matrix[0, 2], matrix[0, 3] = xx + yy + zz, yz - zy, zx - xz, xy - yx
    matrix[1, 1], matrix[1, 2], matrix[1, 3] = xx - yy - zz, xy + yx, zx + xz
    matrix[2, 2], matrix[2, 3], matrix[3, 3] = yy - xx - zz, yz + zy, zz - xx - yy
    # Correspondences with one single point: what is left of the sums is rounding, and no rotation is better than any.
    rounding = 1e-24 * (q0 * q0 + q1 * q1 + q2 * q2) * (p0 * p0 + p1 * p1 + p2 * p2)
    if xx**2 + xy**2 + xz**2 + yx**2 + yy**2 + yz**2 + zx**2 + zy**2 + zz**2 <= rounding:
        matrix[:] = 0.0
    largest = _largest_eigenvector(matrix, vectors)
    w, x, y, z = vectors[0, largest], vectors[1, largest], vectors[2, largest], vectors[3, largest]
    r00, r01, r02 = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    r10, r11, r12 = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    r20, r21, r22 = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
    t0, t1, t2 = pose[0, 3] - p0, pose[1, 3] - p1, pose[2, 3] - p2
    pose[0, 3] = r00 * t0 + r01 * t1 + r02 * t2 + q0
    pose[1, 3] = r10 * t0 + r11 * t1 + r12 * t2 + q1
    pose[2, 3] = r20 * t0 + r21 * t1 + r22 * t2 + q2
    for j in range(3):
        a, b, c = pose[0, j], pose[1, j], pose[2, j]
        pose[0, j] = r00 * a + r01 * b + r02 * c
        pose[1, j] = r10 * a + r11 * b + r12 * c
        pose[2, j] = r20 * a + r21 * b + r22 * c


@njit(**INNER_LOOP)
def _largest_eigenvector(matrix, vectors):
    """Diagonalize a symmetric 4×4 matrix (upper half) by Jacobi rotations; return the largest eigenvalue's column."""
    for i in range(4):
        for j in range(4):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(30):
        off = 0.0
        for i in range(3):
            for j in range(i + 1, 4):
                off += matrix[i, j] * matrix[i, j]
        if off < 1e-40:
            break
        for i in range(3):
            for j in range(i + 1, 4):
                if matrix[i, j] == 0.0:
                    continue
                theta = (matrix[j, j] - matrix[i, i]) / (2 * matrix[i, j])
                t = 1 / (abs(theta) + np.sqrt(theta * theta + 1))
                if theta < 0:
                    t = -t
                c = 1 / np.sqrt(t * t + 1)
                s = t * c
                matrix[i, i] -= t * matrix[i, j]
                matrix[j, j] += t * matrix[i, j]
                matrix[i, j] = 0.0
                for k in range(4):
                    if k != i and k != j:
                        a, b = (min(k, i), max(k, i)), (min(k, j), max(k, j))
                        u, v = matrix[a], matrix[b]
                        matrix[a], matrix[b] = c * u - s * v, s * u + c * v
                    u, v = vectors[k, i], vectors[k, j]
                    vectors[k, i], vectors[k, j] = c * u - s * v, s * u + c * v
    largest = 0
    for i in range(1, 4):
        if matrix[i, i] > matrix[largest, largest]:
            largest = i
    return largest
