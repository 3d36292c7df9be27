"""Compiled loops behind :class:`gpca.reenactment.mixture.Mixture`: expectation maximization from many poses."""

from __future__ import annotations

import numpy as np

from gpca.alignment.icp_kernels import move
from gpca.process.compilation import INNER_LOOP, njit

REACH = 14.0  # squared distance, in variances, beyond which a partner's weight of e⁻⁷ counts as none
FIRST_WIDTH, LARGEST_WIDTH = 0.03, 0.12  # diameters, standard deviation per axis
FIRST_OUTLIERS, FEWEST_OUTLIERS, MOST_OUTLIERS = 0.05, 0.01, 0.2
UNMATCHED = 0.25  # share of the points whose surface the model may lack, beforehand
STILL = 1e-5  # change of a pose's largest entry, and
SETTLED = 1e-3  # of the variance relative to it, at which a fit has converged
# e⁻ᵗ for 0 <= t <= 7 is the eighth power of a polynomial around the middle of the eighths, within 1e-10 of it.
MIDDLE = REACH / 32
AT_MIDDLE = float(np.exp(-MIDDLE))


@njit(ahead="d2 d2", cache=True, error_model="numpy")
def densities_among(points, densities):
    """Add the density (LEVELS, N) of the other points around each of the points (N, 3).

    It is that of normals, of `LARGEST_WIDTH` in the first row and of half the variance of the last row in each other.
    """
    count, levels = densities.shape[1], densities.shape[0]
    factor = 0.5 / LARGEST_WIDTH**2
    for i in range(count):
        for j in range(i):
            x, y, z = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1], points[i, 2] - points[j, 2]
            t = factor * (x * x + y * y + z * z)
            if t >= 0.5 * REACH:
                continue
            w = _decay(t)
            for level in range(levels):
                densities[level, i] += w
                densities[level, j] += w
                w *= w
                if w < 1e-9:
                    break
    for level in range(levels):
        scale = (2 * np.pi * LARGEST_WIDTH**2 / 2.0**level) ** -1.5 / count
        for i in range(count):
            densities[level, i] *= scale


@njit(ahead="d2 d3 l ? d d d d2 l1 d1 d l1 d2 d1 d1 d1 d2 d2", cache=True, error_model="numpy")
def fit_all(
    observed, poses, iterations, moving, precision, arm, least, points, starts, low, cell, cells, densities,
    likelihood, variance, outliers, matched, lone,
):  # fmt: skip
    """Maximize the likelihood of the observed points (N, 3) from every pose (n, 4, 4), in place.

    Precision and arm are those of :class:`gpca.reenactment.mixture.Anchor`, 0 for none; `least` is the smallest
    variance; points (3, M) are in the order of their cells; without rows of densities, the model lacks no surface.
    Replaces the variance (n,); fills likelihood and outliers (n,), matched and lone (n, N) as :func:`_expect` says.
    """
    moments, room, near = np.empty((4, 4)), np.empty((8, 4)), np.empty_like(points)
    before = np.empty((4, 4))
    count = len(observed)
    for n in range(len(poses)):
        pose = poses[n]
        outliers[n] = FIRST_OUTLIERS
        converged = False
        for iteration in range(iterations + 1):
            likelihood[n], weight, square, alone = _expect(
                observed, pose, points, starts, low, cell, cells, densities, variance[n], outliers[n],
                matched[n], lone[n], moments, near,
            )  # fmt: skip
            if iteration == iterations or converged:
                break
            if weight > 1e-9:
                old = variance[n]
                variance[n] = min(max(square / (3 * weight), least), LARGEST_WIDTH**2)
                converged = abs(variance[n] - old) <= SETTLED * old
                if moving:
                    for i in range(4):  # for `before[:] = pose` numba would compile the text of an error, for seconds
                        for j in range(4):
                            before[i, j] = pose[i, j]
                    _anchor(pose, moments, arm, precision * variance[n] / 6)
                    moments /= moments[3, 3]
                    move(pose, moments, room)
                    converged = converged and _change(before, pose) <= STILL
            outliers[n] = min(max(1 - weight / count - alone, FEWEST_OUTLIERS), MOST_OUTLIERS)


@njit(**INNER_LOOP)
def _expect(
    observed, pose, points, starts, low, cell, cells, densities, variance, outliers, matched, lone,
    moments, near,
):  # fmt: skip
    """Fill how probably each point (N,) lies on the model's surface, and on surface that the model lacks.

    Fills Σ w [q, 1] [p, 1]ᵀ over points p and partners q as well. Returns the mean log-likelihood, Σ w, Σ w times the
    mean squared distance of each point from its partners, and the share of surface that the model lacks.
    """
    limit, factor = REACH * variance, 0.5 / variance
    unmatched = UNMATCHED if len(densities) else 0.0
    scale = (1.0 - outliers - unmatched) / points.shape[1] * (2 * np.pi * variance) ** -1.5
    total, weight, square, alone = 0.0, 0.0, 0.0, 0.0
    moments[:] = 0.0
    above = np.log2(LARGEST_WIDTH**2 / variance)  # levels of the densities
    level = max(min(int(above), len(densities) - 2), 0)
    part = above - level
    for i in range(len(observed)):
        x, y, z = observed[i, 0], observed[i, 1], observed[i, 2]
        px = pose[0, 0] * x + pose[0, 1] * y + pose[0, 2] * z + pose[0, 3]
        py = pose[1, 0] * x + pose[1, 1] * y + pose[1, 2] * z + pose[1, 3]
        pz = pose[2, 0] * x + pose[2, 1] * y + pose[2, 2] * z + pose[2, 3]
        found = _list_near(px, py, pz, limit, points, starts, low, cell, cells, near)
        s, sx, sy, sz, sd = _sums(px, py, pz, limit, factor, near, found)
        lacked = 0.0
        if unmatched > 0.0:
            lacked = unmatched * max((1 - part) * densities[level, i] + part * densities[level + 1, i], 0.0)
        density = scale * s + lacked + outliers  # the cube of the outliers has edge 1
        total += np.log(density)
        w = scale * s / density
        matched[i], lone[i] = w, lacked / density
        alone += lacked / density
        if s > 0.0:
            weight += w
            square += w * (sd / s)
            qx, qy, qz = w * (px - sx / s), w * (py - sy / s), w * (pz - sz / s)
            moments[0, 0] += qx * px
            moments[0, 1] += qx * py
            moments[0, 2] += qx * pz
            moments[0, 3] += qx
            moments[1, 0] += qy * px
            moments[1, 1] += qy * py
            moments[1, 2] += qy * pz
            moments[1, 3] += qy
            moments[2, 0] += qz * px
            moments[2, 1] += qz * py
            moments[2, 2] += qz * pz
            moments[2, 3] += qz
            moments[3, 0] += w * px
            moments[3, 1] += w * py
            moments[3, 2] += w * pz
            moments[3, 3] += w
    return total / len(observed), weight, square, alone / len(observed)


@njit(**INNER_LOOP)
def _list_near(px, py, pz, limit, points, starts, low, cell, cells, near):
    """Copy the points of all cells that reach into the sphere into `near` (3, M); return how many they are."""
    radius, found = np.sqrt(limit), 0
    i_low, i_high = _cells_within(px, low[0], cell, cells[0], radius)
    j_low, j_high = _cells_within(py, low[1], cell, cells[1], radius)
    for a in range(i_low, i_high):
        x = max(low[0] + a * cell - px, px - low[0] - (a + 1) * cell, 0.0)
        for b in range(j_low, j_high):
            y = max(low[1] + b * cell - py, py - low[1] - (b + 1) * cell, 0.0)
            rest = limit - x * x - y * y
            if rest <= 0.0:
                continue
            k_low, k_high = _cells_within(pz, low[2], cell, cells[2], np.sqrt(rest))
            if k_low < k_high:
                # Cells along the last axis follow each other.
                row = (a * cells[1] + b) * cells[2]
                for m in range(starts[row + k_low], starts[row + k_high]):
                    near[0, found], near[1, found], near[2, found] = points[0, m], points[1, m], points[2, m]
                    found += 1
    return found


@njit(**INNER_LOOP)
def _sums(px, py, pz, limit, factor, near, found):
    """Return Σ w, Σ w r (three), Σ w |r|² over the listed partners at p - r, with w = e^(-factor |r|²) within reach."""
    s, sx, sy, sz, sd = 0.0, 0.0, 0.0, 0.0, 0.0
    for m in range(found):
        dx, dy, dz = px - near[0, m], py - near[1, m], pz - near[2, m]
        d = dx * dx + dy * dy + dz * dz
        w = _decay(factor * min(d, limit))
        w = w if d < limit else 0.0
        s += w
        sx += w * dx
        sy += w * dy
        sz += w * dz
        sd += w * d
    return s, sx, sy, sz, sd


@njit(forceinline=True, **INNER_LOOP)
def _decay(t):
    """Return e⁻ᵗ for 0 <= t <= 7; unlike the C library's, it is computed for several numbers at once."""
    u = 0.125 * t - MIDDLE
    p = 1 / 3628800
    p = p * u - 1 / 362880
    p = p * u + 1 / 40320
    p = p * u - 1 / 5040
    p = p * u + 1 / 720
    p = p * u - 1 / 120
    p = p * u + 1 / 24
    p = p * u - 1 / 6
    p = p * u + 1 / 2
    p = p * u - 1.0
    p = AT_MIDDLE * (p * u + 1.0)
    p = p * p
    p = p * p
    return p * p


@njit(**INNER_LOOP)
def _anchor(pose, moments, arm, weight):
    """Add six points at ±arm on the axes, which the pose has moved and which ought to stay."""
    for axis in range(3):
        for sign in (-1.0, 1.0):
            for i in range(3):
                p = pose[i, 3] + sign * arm * pose[i, axis]
                moments[axis, i] += weight * sign * arm * p
                moments[3, i] += weight * p
            moments[axis, 3] += weight * sign * arm
            moments[3, 3] += weight


@njit(**INNER_LOOP)
def _change(before, pose):
    largest = 0.0
    for i in range(3):
        for j in range(4):
            largest = max(largest, abs(pose[i, j] - before[i, j]))
    return largest


@njit(**INNER_LOOP)
def _cells_within(x, low, cell, cells, radius):
    first, last = int(np.floor((x - radius - low) / cell)), int(np.floor((x + radius - low) / cell))
    return max(0, first), min(cells, last + 1)
