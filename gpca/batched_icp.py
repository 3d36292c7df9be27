"""ICP of one source to one target from many initial poses, with everything that the runs share worked out once.

Point-to-point runs are our own compiled loop with Open3D's steps and stopping rule, and end at Open3D's poses
(tests/test_batched_icp.py): Open3D builds a tree of the target for every initial pose and searches it for every point
in every iteration. `benchmarks/explainers.py` measures both. The other methods call Open3D once per initial pose.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from gpca.errors import InputError
from gpca.neighbours import LISTED, OPTIONS, make_target, nearest
from gpca.registration import ICP, ICPSettings

CONVERGED = 1e-6  # largest change of fitness and of inlier RMSE in the last iteration; Open3D's default


class BatchedICP:
    """ICP to one target.

    Args:
        target: (P, 3) points, any unit; results come in the same unit.
        settings: the correspondence distance is in the unit of the points.
        target_normals: (P, 3), needed by point-to-plane and generalized ICP.

    Raises:
        InputError: fewer than three points, or NaN.
    """

    def __init__(self, target: np.ndarray, settings: ICPSettings, target_normals: np.ndarray | None = None) -> None:
        _require_cloud("target cloud", target)
        self._settings = settings
        if settings.method == "point_to_point":
            self._target = make_target(target, settings.correspondence_distance)
        else:
            self._icp = ICP(target, target_normals, settings)

    def register(
        self, source: np.ndarray, T_target_source_init_n: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Align `source` (N, 3) from n initial poses (n, 4, 4).

        Returns:
            T_target_source (n, 4, 4), fitness (n,), inlier RMSE (n,), as
            :class:`gpca.registration.Registration` has them.

        Raises:
            InputError: fewer than three points, or NaN.
        """
        _require_cloud("source cloud", source)
        poses_n = np.array(T_target_source_init_n, np.float64)
        if self._settings.method == "point_to_point":
            fitness_n, rmse_n = np.empty(len(poses_n)), np.empty(len(poses_n))
            source = np.ascontiguousarray(source, np.float64)
            _align_all(source, self._target, poses_n, fitness_n, rmse_n, self._settings.max_iterations)
            return poses_n, fitness_n, rmse_n
        runs = [self._icp.register(source, pose) for pose in poses_n]
        fitness_n, rmse_n = np.array([(run.fitness, run.inlier_rmse) for run in runs]).T
        return np.array([run.T_target_source for run in runs]), fitness_n, rmse_n


def _require_cloud(name: str, points: np.ndarray) -> None:
    if len(points) < 3 or not np.isfinite(points).all():
        raise InputError(name, f"{len(points)} points, or NaN among them", "give at least 3 finite points")


@njit(cache=True)
def _align_all(source, target, poses, fitness, rmse, max_iterations):
    room = np.empty(LISTED)
    moments, matrices = np.empty((4, 4)), np.empty((8, 4))
    neighbour = np.empty(len(source), np.int64)
    held = np.zeros((len(source), 4))  # where a point's neighbour was searched, and the square of the radius around it
    for n in range(len(poses)):
        pose = poses[n]
        held[:, 3] = -1.0  # nothing was searched yet
        fitness[n], rmse[n] = _correspond(source, target, pose, moments, room, neighbour, held)
        for _ in range(max_iterations):
            if fitness[n] > 0:
                _move(pose, moments, matrices)
            old_fitness, old_rmse = fitness[n], rmse[n]
            fitness[n], rmse[n] = _correspond(source, target, pose, moments, room, neighbour, held)
            if abs(old_fitness - fitness[n]) < CONVERGED and abs(old_rmse - rmse[n]) < CONVERGED:
                break


@njit(**OPTIONS)
def _correspond(source, target, pose, moments, room, neighbour, held):
    """Return fitness and inlier RMSE at a pose, and in `moments` the mean of [q, 1] [p, 1]ᵀ over correspondences."""
    r00, r01, r02, t0 = pose[0, 0], pose[0, 1], pose[0, 2], pose[0, 3]
    r10, r11, r12, t1 = pose[1, 0], pose[1, 1], pose[1, 2], pose[1, 3]
    r20, r21, r22, t2 = pose[2, 0], pose[2, 1], pose[2, 2], pose[2, 3]
    points, starts, low, cell, cells, voxel, voxels, list_of_voxel, listed, offsets, reach, used, distance = target
    limit = distance * distance
    count, squares = 0, 0.0
    m00 = m01 = m02 = m03 = m10 = m11 = m12 = m13 = m20 = m21 = m22 = m23 = m30 = m31 = m32 = 0.0
    for i in range(len(source)):
        x, y, z = source[i, 0], source[i, 1], source[i, 2]
        px = r00 * x + r01 * y + r02 * z + t0
        py = r10 * x + r11 * y + r12 * z + t1
        pz = r20 * x + r21 * y + r22 * z + t2
        # As long as a point stays within the radius around where its neighbour was searched, it keeps it.
        moved = (px - held[i, 0]) ** 2 + (py - held[i, 1]) ** 2 + (pz - held[i, 2]) ** 2
        if moved >= held[i, 3]:
            index, radius = nearest(
                px,
                py,
                pz,
                room,
                points,
                starts,
                low,
                cell,
                cells,
                voxel,
                voxels,
                list_of_voxel,
                listed,
                offsets,
                reach,
                used,
                distance,
            )
            neighbour[i] = index
            held[i, 0], held[i, 1], held[i, 2], held[i, 3] = px, py, pz, radius * radius
        index = neighbour[i]
        if index < 0:
            continue
        qx, qy, qz = points[index, 0], points[index, 1], points[index, 2]
        square = (px - qx) ** 2 + (py - qy) ** 2 + (pz - qz) ** 2
        if square < limit:
            count += 1
            squares += square
            m00, m01, m02, m03 = m00 + qx * px, m01 + qx * py, m02 + qx * pz, m03 + qx
            m10, m11, m12, m13 = m10 + qy * px, m11 + qy * py, m12 + qy * pz, m13 + qy
            m20, m21, m22, m23 = m20 + qz * px, m21 + qz * py, m22 + qz * pz, m23 + qz
            m30, m31, m32 = m30 + px, m31 + py, m32 + pz
    if count == 0:
        return 0.0, 0.0
    moments[0, 0], moments[0, 1], moments[0, 2], moments[0, 3] = m00, m01, m02, m03
    moments[1, 0], moments[1, 1], moments[1, 2], moments[1, 3] = m10, m11, m12, m13
    moments[2, 0], moments[2, 1], moments[2, 2], moments[2, 3] = m20, m21, m22, m23
    moments[3, 0], moments[3, 1], moments[3, 2], moments[3, 3] = m30, m31, m32, count
    moments /= count
    return count / len(source), np.sqrt(squares / count)


@njit(**OPTIONS)
def _move(pose, moments, room):
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


@njit(**OPTIONS)
def _largest_eigenvector(matrix, vectors):
    """Diagonalise a symmetric 4×4 matrix (upper half) by Jacobi rotations; return the largest eigenvalue's column."""
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
