"""Compiled ICP: the nearest target point by lists of points per voxel, and the loops over poses and points.

Target points are sorted into cells. Space is also cut into voxels: the first query in a voxel lists the target points
nearest to the voxel's center, and later queries there, in any iteration and from any initial pose, choose among those.
A list knows the radius within which it is complete; where that does not suffice, the cells are searched, so the
neighbor is always the true one.
"""

from __future__ import annotations

import numpy as np

from gpca.process.compilation import INNER_LOOP, njit

LISTED = 16  # target points per voxel
FLAT = 1e-3  # variance along the normal of a plane of generalized ICP, of that within it; Open3D's default
TARGET = "( d2 l1 d1 d l1 d l1 i1 i2 d3 d1 l1 d )"  # types of the fields of a target, see `njit`


@njit(forceinline=True, **INNER_LOOP)
def nearest(
    x, y, z, room, points, starts, low, cell, cells, voxel, voxels, list_rows, listed, offsets, reach, used, distance
):
    """Return the row of the target point nearest to (x, y, z), -1 if none is within the distance, and a safe radius.

    Any query within that radius of (x, y, z) has the same result. `room` (LISTED,) float64 is working space; the other
    arguments are the fields of :class:`gpca.alignment.batched_icp.Target`.
    """
    per = 1.0 / voxel
    i_voxel = (x - low[0] + distance) * per
    j_voxel = (y - low[1] + distance) * per
    k_voxel = (z - low[2] + distance) * per
    if (
        not (i_voxel >= 0 and j_voxel >= 0 and k_voxel >= 0)
        or i_voxel >= voxels[0]
        or j_voxel >= voxels[1]
        or k_voxel >= voxels[2]
    ):
        return -1, 0.0
    i, j, k = int(i_voxel), int(j_voxel), int(k_voxel)
    cx = low[0] - distance + (i + 0.5) * voxel
    cy = low[1] - distance + (j + 0.5) * voxel
    cz = low[2] - distance + (k + 0.5) * voxel
    flat = (i * voxels[1] + j) * voxels[2] + k
    row = list_rows[flat]
    if row < 0 and used[0] < len(listed):
        row = used[0]
        used[0] += 1
        list_rows[flat] = row
        reach[row] = _list_nearest(
            points, starts, low, cell, cells, distance + voxel, cx, cy, cz, listed[row], offsets[row], room
        )
    if row >= 0:
        dx, dy, dz = x - cx, y - cy, z - cz
        chosen, first_square, second_square = _two_closest(offsets, row, dx, dy, dz)
        complete = reach[row] - np.sqrt(dx * dx + dy * dy + dz * dz)
        # An unlisted point may be the second nearest. The radius leaves room for rounding.
        first, second = np.sqrt(first_square), min(np.sqrt(second_square), complete)
        if first < distance and first <= complete:
            return listed[row, chosen], max(0.0, 0.5 * (second - first) - 1e-9 * distance)
        if min(first, complete) >= distance:
            return -1, max(0.0, min(first, complete) - distance - 1e-9 * distance)
    return _search(points, starts, low, cell, cells, distance, x, y, z), 0.0


@njit(forceinline=True, **INNER_LOOP)
def _two_closest(offsets, row, dx, dy, dz):
    # Without a branch: the nearest point is unpredictable, and a misprediction costs more than the rest.
    first, second, chosen = np.inf, np.inf, 0
    for slot in range(LISTED):
        a, b, c = offsets[row, 0, slot] - dx, offsets[row, 1, slot] - dy, offsets[row, 2, slot] - dz
        square = a * a + b * b + c * c
        second = min(second, max(first, square))
        chosen = slot if square < first else chosen
        first = min(first, square)
    return chosen, first, second


@njit(**INNER_LOOP)
def _list_nearest(points, starts, low, cell, cells, radius, x, y, z, listed, offsets, squares):
    """List the points nearest to a voxel's center; return the radius within which the list is complete."""
    window = 1
    while True:
        squares[:] = radius * radius
        listed[:] = -1
        i_low, i_high = _cells_around(x, low[0], cell, cells[0], window)
        j_low, j_high = _cells_around(y, low[1], cell, cells[1], window)
        k_low, k_high = _cells_around(z, low[2], cell, cells[2], window)
        for i in range(i_low, i_high):
            for j in range(j_low, j_high):
                first, last = _points_of(starts, cells, i, j, k_low, k_high)
                for p in range(first, last):
                    square = _square(points, p, x, y, z)
                    if square < squares[LISTED - 1]:
                        slot = LISTED - 1
                        while slot > 0 and squares[slot - 1] > square:
                            squares[slot] = squares[slot - 1]
                            listed[slot] = listed[slot - 1]
                            slot -= 1
                        squares[slot] = square
                        listed[slot] = p
        reached = _reached(low, cell, x, y, z, window)
        if reached * reached >= squares[LISTED - 1]:
            break
        window += 1
    for slot in range(LISTED):
        p = listed[slot]
        offsets[0, slot] = points[p, 0] - x if p >= 0 else np.inf
        offsets[1, slot] = points[p, 1] - y if p >= 0 else np.inf
        offsets[2, slot] = points[p, 2] - z if p >= 0 else np.inf
    return np.sqrt(squares[LISTED - 1])


@njit(**INNER_LOOP)
def _search(points, starts, low, cell, cells, radius, x, y, z):
    window = 1
    while True:
        best, index = radius * radius, -1
        i_low, i_high = _cells_around(x, low[0], cell, cells[0], window)
        j_low, j_high = _cells_around(y, low[1], cell, cells[1], window)
        k_low, k_high = _cells_around(z, low[2], cell, cells[2], window)
        for i in range(i_low, i_high):
            for j in range(j_low, j_high):
                first, last = _points_of(starts, cells, i, j, k_low, k_high)
                for p in range(first, last):
                    square = _square(points, p, x, y, z)
                    if square < best:
                        best, index = square, p
        reached = _reached(low, cell, x, y, z, window)
        if reached * reached >= best:
            return index
        window += 1


@njit(forceinline=True, **INNER_LOOP)
def _square(points, p, x, y, z):
    return (x - points[p, 0]) ** 2 + (y - points[p, 1]) ** 2 + (z - points[p, 2]) ** 2


@njit(**INNER_LOOP)
def _cells_around(x, low, cell, cells, window):
    i = int(np.floor((x - low) / cell))
    return max(0, i - window), min(cells, i + window + 1)


@njit(forceinline=True, **INNER_LOOP)
def _points_of(starts, cells, i, j, k_low, k_high):
    if k_low >= k_high:
        return 0, 0
    row = (i * cells[1] + j) * cells[2]
    return starts[row + k_low], starts[row + k_high]


@njit(**INNER_LOOP)
def _reached(low, cell, x, y, z, window):
    """Return the distance to the border of the window of cells around a point."""
    a, b, c = (x - low[0]) % cell, (y - low[1]) % cell, (z - low[2]) % cell
    wall = min(min(min(a, cell - a), min(b, cell - b)), min(c, cell - c))
    return window * cell + wall


@njit(ahead=f"d2 {TARGET} d3 d1 d1 l d", cache=True)
def align_all(source, target, poses, fitness, rmse, max_iterations, converged):
    """Align the source (N, 3) from every pose (n, 4, 4), in place, until fitness (n,) and inlier RMSE (n,) rest."""
    room = np.empty(LISTED)
    moments, matrices = np.empty((4, 4)), np.empty((8, 4))
    neighbor = np.empty(len(source), np.int64)
    # For each point, the position of its last query and the square of the safe radius around it.
    held = np.zeros((len(source), 4))
    for n in range(len(poses)):
        pose = poses[n]
        held[:, 3] = -1.0  # no query yet
        fitness[n], rmse[n] = _correspond(source, target, pose, moments, room, neighbor, held)
        for _ in range(max_iterations):
            if fitness[n] > 0:
                move(pose, moments, matrices)
            old_fitness, old_rmse = fitness[n], rmse[n]
            fitness[n], rmse[n] = _correspond(source, target, pose, moments, room, neighbor, held)
            if abs(old_fitness - fitness[n]) < converged and abs(old_rmse - rmse[n]) < converged:
                break


@njit(ahead=f"d2 {TARGET} d3 d2 d1 d1", cache=True)
def pull_all(source, target, poses, pulls, fitness, rmse):
    """At every pose (n, 4, 4), fill the mean of [y × r, r] (n, 6) over correspondences, r = y - q of moved points."""
    room, moments = np.empty(LISTED), np.empty((4, 4))
    neighbor, held = np.empty(len(source), np.int64), np.zeros((len(source), 4))
    for n in range(len(poses)):
        held[:, 3] = -1.0
        moments[:] = 0.0
        fitness[n], rmse[n] = _correspond(source, target, poses[n], moments, room, neighbor, held)
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            pulls[n, i] = moments[j, k] - moments[k, j]
            pulls[n, 3 + i] = moments[3, i] - moments[i, 3]


@njit(ahead=f"d2 d2 {TARGET} d2 d3 d3 d2 d1 d1", cache=True)
def plane_all(source, source_normals, target, normals, poses, hessians, gradients, fitness, rmse):
    """At every pose fill Σ JᵀWJ (n, 6, 6), Σ JᵀWr (n, 6) over correspondences, r = y - q, J = [-[y], I].

    W = n nᵀ keeps distances from planes; where the source has normals m as well, W = (C(n) + C(m))⁻¹ with
    C(n) = I - (1 - `FLAT`) n nᵀ, as in generalized ICP. `normals` (P, 3) are in the order of the target's points.
    """
    room, row = np.empty(LISTED), np.empty(6)
    for n in range(len(poses)):
        hessian, gradient = hessians[n], gradients[n]
        hessian[:], gradient[:] = 0.0, 0.0
        fitness[n], rmse[n] = _plane_sums(
            source, source_normals, target, normals, poses[n], hessian, gradient, room, row
        )


@njit(**INNER_LOOP)
def _plane_sums(source, source_normals, target, normals, pose, hessian, gradient, room, row):
    points, starts, low, cell, cells, voxel, voxels, list_rows, listed, offsets, reach, used, distance = target
    lists = (voxel, voxels, list_rows, listed, offsets, reach, used, distance)
    count, squares, generalized = 0, 0.0, len(source_normals) > 0
    for i in range(len(source)):
        x, y, z = source[i, 0], source[i, 1], source[i, 2]
        px = pose[0, 0] * x + pose[0, 1] * y + pose[0, 2] * z + pose[0, 3]
        py = pose[1, 0] * x + pose[1, 1] * y + pose[1, 2] * z + pose[1, 3]
        pz = pose[2, 0] * x + pose[2, 1] * y + pose[2, 2] * z + pose[2, 3]
        index = nearest(px, py, pz, room, points, starts, low, cell, cells, *lists)[0]
        if index < 0:
            continue
        rx, ry, rz = px - points[index, 0], py - points[index, 1], pz - points[index, 2]
        square = rx * rx + ry * ry + rz * rz
        if square >= distance * distance:
            continue
        count += 1
        squares += square
        nx, ny, nz = normals[index, 0], normals[index, 1], normals[index, 2]
        if not generalized:
            _add(hessian, gradient, row, px, py, pz, rx, ry, rz, nx, ny, nz, 1.0)
            continue
        a, b, c = source_normals[i, 0], source_normals[i, 1], source_normals[i, 2]
        mx = pose[0, 0] * a + pose[0, 1] * b + pose[0, 2] * c
        my = pose[1, 0] * a + pose[1, 1] * b + pose[1, 2] * c
        mz = pose[2, 0] * a + pose[2, 1] * b + pose[2, 2] * c
        for axis in range(3):
            _add(hessian, gradient, row, px, py, pz, rx, ry, rz, axis == 0, axis == 1, axis == 2, 0.5)
        # The sum and the difference of both normals are eigenvectors.
        for sign in (1.0, -1.0):
            ux, uy, uz = nx + sign * mx, ny + sign * my, nz + sign * mz
            length = ux * ux + uy * uy + uz * uz
            if length > 1e-12:
                weight = 1.0 / (2.0 - (1.0 - FLAT) * 0.5 * length) - 0.5
                _add(hessian, gradient, row, px, py, pz, rx, ry, rz, ux, uy, uz, weight / length)
    return count / len(source), np.sqrt(squares / max(count, 1))


@njit(forceinline=True, **INNER_LOOP)
def _add(hessian, gradient, row, px, py, pz, rx, ry, rz, nx, ny, nz, weight):
    row[0], row[1], row[2] = py * nz - pz * ny, pz * nx - px * nz, px * ny - py * nx
    row[3], row[4], row[5] = nx, ny, nz
    off_plane = weight * (rx * nx + ry * ny + rz * nz)
    for a in range(6):
        gradient[a] += row[a] * off_plane
        for b in range(6):
            hessian[a, b] += weight * row[a] * row[b]


@njit(**INNER_LOOP)
def _correspond(source, target, pose, moments, room, neighbor, held):
    """Return fitness and inlier RMSE at a pose, and in `moments` the mean of [q, 1] [p, 1]ᵀ over correspondences."""
    r00, r01, r02, t0 = pose[0, 0], pose[0, 1], pose[0, 2], pose[0, 3]
    r10, r11, r12, t1 = pose[1, 0], pose[1, 1], pose[1, 2], pose[1, 3]
    r20, r21, r22, t2 = pose[2, 0], pose[2, 1], pose[2, 2], pose[2, 3]
    points, starts, low, cell, cells, voxel, voxels, list_rows, listed, offsets, reach, used, distance = target
    lists = (voxel, voxels, list_rows, listed, offsets, reach, used, distance)
    limit = distance * distance
    count, squares = 0, 0.0
    m00 = m01 = m02 = m03 = m10 = m11 = m12 = m13 = m20 = m21 = m22 = m23 = m30 = m31 = m32 = 0.0
    for i in range(len(source)):
        x, y, z = source[i, 0], source[i, 1], source[i, 2]
        px = r00 * x + r01 * y + r02 * z + t0
        py = r10 * x + r11 * y + r12 * z + t1
        pz = r20 * x + r21 * y + r22 * z + t2
        # A point keeps its neighbor as long as it stays within the safe radius of its last query.
        moved = (px - held[i, 0]) ** 2 + (py - held[i, 1]) ** 2 + (pz - held[i, 2]) ** 2
        if moved >= held[i, 3]:
            index, radius = nearest(px, py, pz, room, points, starts, low, cell, cells, *lists)
            neighbor[i] = index
            held[i, 0], held[i, 1], held[i, 2], held[i, 3] = px, py, pz, radius * radius
        index = neighbor[i]
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


@njit(**INNER_LOOP)
def move(pose, moments, room):
    """Apply the rigid motion of least squares between corresponding points to the pose (Horn 1987, by quaternions)."""
    q0, q1, q2 = moments[0, 3], moments[1, 3], moments[2, 3]
    p0, p1, p2 = moments[3, 0], moments[3, 1], moments[3, 2]
    # Sums in Horn's notation: products of the source's first and the target's second coordinate.
    xx, yx, zx = moments[0, 0] - q0 * p0, moments[0, 1] - q0 * p1, moments[0, 2] - q0 * p2
    xy, yy, zy = moments[1, 0] - q1 * p0, moments[1, 1] - q1 * p1, moments[1, 2] - q1 * p2
    xz, yz, zz = moments[2, 0] - q2 * p0, moments[2, 1] - q2 * p1, moments[2, 2] - q2 * p2
    matrix, vectors = room[:4], room[4:]
    matrix[0, 0], matrix[0, 1], matrix[0, 2], matrix[0, 3] = xx + yy + zz, yz - zy, zx - xz, xy - yx
    matrix[1, 1], matrix[1, 2], matrix[1, 3] = xx - yy - zz, xy + yx, zx + xz
    matrix[2, 2], matrix[2, 3], matrix[3, 3] = yy - xx - zz, yz + zy, zz - xx - yy
    # Correspondences with a single point leave only rounding in the sums: all rotations are equally good.
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
