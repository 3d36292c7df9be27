"""Compiled loops behind :mod:`gpca.encoders.groups`: sampling, ball query, and passes over the groups' edges.

Edges e are the distinct pairs of a group and one of its points, ordered by cloud and group: cloud b has the rows
``cloud_ends[b]`` to ``cloud_ends[b + 1]``, group g the rows ``ends[g]`` to ``ends[g + 1]``. All arrays are C-contiguous
float32. Clouds run in parallel, are summed one by one and added in order, so that the number of threads changes no bit.
"""

from __future__ import annotations

import numpy as np

from gpca.process.compilation import OVER_CLOUDS, njit, prange

_BLOCK = 64  # rows that are summed in the arrays' own precision before they are added in double


@njit(**OVER_CLOUDS)
def farthest_points(points, n_centers):
    """Return (B, M): point 0, then always the point farthest from all chosen ones, ties to the lower index."""
    batch, n, _ = points.shape
    chosen = np.zeros((batch, n_centers), np.int32)
    for b in prange(batch):
        x, y, z = points[b, :, 0].copy(), points[b, :, 1].copy(), points[b, :, 2].copy()
        nearest = np.full(n, np.inf, points.dtype)  # squared distance to the nearest chosen point
        last = 0
        for m in range(1, n_centers):
            farthest = points.dtype.type(-1)
            for i in range(n):
                dx, dy, dz = x[i] - x[last], y[i] - y[last], z[i] - z[last]
                nearest[i] = min(nearest[i], dx * dx + dy * dy + dz * dz)
                farthest = max(farthest, nearest[i])
            last = 0
            while last < n - 1 and nearest[last] != farthest:
                last += 1
            chosen[b, m] = last
    return chosen


@njit(**OVER_CLOUDS)
def ball_query(points, centers, radius, k):
    """Return neighbors (B, M, k) and counts (B, M), as :class:`gpca.encoders.groups.Groups` has them."""
    batch, n, _ = points.shape
    n_centers = centers.shape[1]
    # Not np.empty: a center of NaN has no neighbor, but the slots must still be indices of points.
    neighbors = np.zeros((batch, n_centers, k), np.int32)
    counts = np.zeros((batch, n_centers), np.int32)
    limit = points.dtype.type(radius) * points.dtype.type(radius)
    for b in prange(batch):
        x, y, z = points[b, :, 0].copy(), points[b, :, 1].copy(), points[b, :, 2].copy()
        squares = np.empty(n, points.dtype)
        for m in range(n_centers):
            cx, cy, cz = centers[b, m, 0], centers[b, m, 1], centers[b, m, 2]
            for i in range(n):
                dx, dy, dz = x[i] - cx, y[i] - cy, z[i] - cz
                squares[i] = dx * dx + dy * dy + dz * dz
            listed = neighbors[b, m]
            count = 0
            for i in range(n):
                # Written always, kept only when within: no branch to mispredict.
                listed[count] = i
                count += squares[i] <= limit
                if count == k:
                    break
            listed[count:] = listed[0] if count else 0
            counts[b, m] = max(count, 1)
    return neighbors, counts


def distinct_edges(neighbors, counts, n_points):
    """Return point (E,), the row of each edge's point in all clouds; weight (E,), the slots it fills; ends (G + 1,)."""
    batch, _, k = neighbors.shape
    ends = np.append(0, np.cumsum(counts, dtype=np.int64))
    rows = neighbors + n_points * np.arange(batch)[:, None, None]
    point, weight = rows[np.arange(k) < counts[..., None]], np.ones(ends[-1], np.float32)
    weight[ends[:-1]] += k - counts.ravel()  # the first point fills the remaining slots
    return point, weight, ends


@njit(**OVER_CLOUDS)
def gather_backward(grad_y, point, ends, batch, n_rows):
    """Return the gradients of a_j + c_g (E, F) with respect to a (P, F) and c (G, F)."""
    features = grad_y.shape[1]
    grad_a = np.zeros((n_rows, features), grad_y.dtype)
    grad_c = np.zeros((len(ends) - 1, features), grad_y.dtype)
    groups = len(grad_c) // batch
    for b in prange(batch):
        for g in range(b * groups, (b + 1) * groups):
            for e in range(ends[g], ends[g + 1]):
                j = point[e]
                for f in range(features):
                    grad_a[j, f] += grad_y[e, f]
                    grad_c[g, f] += grad_y[e, f]
    return grad_a, grad_c


@njit(**OVER_CLOUDS)
def moments(y, weight, cloud_ends):
    """Return mean and biased variance (F,), float64, of the rows of y (E, F), each counted `weight` times."""
    features = y.shape[1]
    batch = len(cloud_ends) - 1
    sums, squares = np.zeros((batch, features)), np.zeros((batch, features))
    for b in prange(batch):
        for start in range(cloud_ends[b], cloud_ends[b + 1], _BLOCK):
            total, square = np.zeros(features, y.dtype), np.zeros(features, y.dtype)
            for e in range(start, min(start + _BLOCK, cloud_ends[b + 1])):
                w = weight[e]
                for f in range(features):
                    total[f] += w * y[e, f]
                    square[f] += w * y[e, f] * y[e, f]
            for f in range(features):
                sums[b, f] += total[f]
                squares[b, f] += square[f]
    weights = weight.astype(np.float64).sum()
    mean, variance = np.zeros(features), np.zeros(features)
    for b in range(batch):
        mean += sums[b] / weights
        variance += squares[b] / weights
    return mean, np.maximum(variance - mean * mean, 0.0)


@njit(**OVER_CLOUDS)
def normalize(y, scale, shift, cloud_ends):
    """Return ReLU(scale y + shift), (E, F)."""
    out = np.empty_like(y)
    zero = y.dtype.type(0)
    for b in prange(len(cloud_ends) - 1):
        for e in range(cloud_ends[b], cloud_ends[b + 1]):
            for f in range(y.shape[1]):
                out[e, f] = max(y[e, f] * scale[f] + shift[f], zero)
    return out


@njit(**OVER_CLOUDS)
def normalize_max(y, scale, shift, ends, batch):
    """Return the maximum of scale y + shift over each group's edges (G, F), and the edge where it is reached."""
    features = y.shape[1]
    groups = (len(ends) - 1) // batch
    out = np.empty((len(ends) - 1, features), y.dtype)
    at = np.empty((len(ends) - 1, features), np.int32)
    for b in prange(batch):
        for g in range(b * groups, (b + 1) * groups):
            best, best_at = out[g], at[g]
            first = ends[g]
            for f in range(features):
                best[f], best_at[f] = y[first, f] * scale[f] + shift[f], first
            for e in range(first + 1, ends[g + 1]):
                edge = np.int32(e)
                for f in range(features):
                    z = y[e, f] * scale[f] + shift[f]
                    better = z > best[f]
                    best[f] = z if better else best[f]
                    best_at[f] = edge if better else best_at[f]
    return out, at


@njit(**OVER_CLOUDS)
def normalize_backward(grad_out, out, y, weight, mean, inverse_std, gamma, cloud_ends):
    """Return grad_y (E, F), grad_gamma (F,), grad_beta (F,) of :func:`normalize` with statistics by :func:`moments`.

    With g_e the gradient that reaches edge e through all of its w_e slots and ŷ the normalized edges, batch norm over
    W = Σ w slots gives

        ∂L/∂γ = Σ g_e ŷ_e,  ∂L/∂β = Σ g_e,  ∂L/∂y_e = γ/σ [ g_e - w_e (∂L/∂β + ŷ_e ∂L/∂γ)/W ] .
    """
    features = y.shape[1]
    batch = len(cloud_ends) - 1
    gamma_parts, beta_parts = np.zeros((batch, features)), np.zeros((batch, features))
    zero = y.dtype.type(0)
    for b in prange(batch):
        for start in range(cloud_ends[b], cloud_ends[b + 1], _BLOCK):
            total, product = np.zeros(features, y.dtype), np.zeros(features, y.dtype)
            for e in range(start, min(start + _BLOCK, cloud_ends[b + 1])):
                for f in range(features):
                    g = grad_out[e, f] if out[e, f] > zero else zero
                    total[f] += g
                    product[f] += g * (y[e, f] - mean[f])
            for f in range(features):
                beta_parts[b, f] += total[f]
                gamma_parts[b, f] += product[f] * inverse_std[f]
    grad_gamma, grad_beta, scale, constant, linear = _affine(gamma_parts, beta_parts, weight, mean, inverse_std, gamma)
    grad_y = np.empty_like(y)
    for b in prange(batch):
        for e in range(cloud_ends[b], cloud_ends[b + 1]):
            w = weight[e]
            for f in range(features):
                g = grad_out[e, f] if out[e, f] > zero else zero
                grad_y[e, f] = scale[f] * g - w * (constant[f] + linear[f] * y[e, f])
    return grad_y, grad_gamma.astype(y.dtype), grad_beta.astype(y.dtype)


@njit(**OVER_CLOUDS)
def normalize_max_backward(grad_out, at, y, weight, mean, inverse_std, gamma, cloud_ends):
    """Return the gradients of :func:`normalize_max`: as :func:`normalize_backward`, with g zero but at the maxima."""
    features = y.shape[1]
    batch = len(cloud_ends) - 1
    groups = len(at) // batch
    gamma_parts, beta_parts = np.zeros((batch, features)), np.zeros((batch, features))
    for b in prange(batch):
        for g in range(b * groups, (b + 1) * groups):
            for f in range(features):
                beta_parts[b, f] += grad_out[g, f]
                gamma_parts[b, f] += grad_out[g, f] * ((y[at[g, f], f] - mean[f]) * inverse_std[f])
    grad_gamma, grad_beta, scale, constant, linear = _affine(gamma_parts, beta_parts, weight, mean, inverse_std, gamma)
    grad_y = np.empty_like(y)
    for b in prange(batch):
        for e in range(cloud_ends[b], cloud_ends[b + 1]):
            w = weight[e]
            for f in range(features):
                grad_y[e, f] = -w * (constant[f] + linear[f] * y[e, f])
        for g in range(b * groups, (b + 1) * groups):
            for f in range(features):
                grad_y[at[g, f], f] += scale[f] * grad_out[g, f]
    return grad_y, grad_gamma.astype(y.dtype), grad_beta.astype(y.dtype)


@njit(cache=True, error_model="numpy")
def _affine(gamma_parts, beta_parts, weight, mean, inverse_std, gamma):
    """Return the added parts, and scale, constant, linear of the gradient scale g_e - w_e (constant + linear y_e)."""
    grad_gamma, grad_beta, weights = gamma_parts.sum(axis=0), beta_parts.sum(axis=0), weight.astype(np.float64).sum()
    scale = gamma * inverse_std
    linear = scale * inverse_std * grad_gamma / weights
    constant = scale * grad_beta / weights - linear * mean
    return grad_gamma, grad_beta, scale, constant.astype(gamma.dtype), linear.astype(gamma.dtype)
