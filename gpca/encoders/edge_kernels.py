"""Compiled passes over neighbors behind :class:`gpca.encoders.dgcnn.EdgeConv`.

Arrays are C-contiguous; ``ac`` (B, N, 2F) holds A in its first F and C in its last F channels. Clouds run in parallel,
are summed one by one and added in order, so that the number of threads changes no bit. A pass fills the arrays that the
function of its name makes.
"""

from __future__ import annotations

import numpy as np

from gpca.process.compilation import OVER_CLOUDS, njit, prange


def smallest_k(distances: np.ndarray, k: int) -> np.ndarray:
    """Return for every row of ``distances`` (B, N, M) the columns of its k smallest entries, ties to the lower column.

    Counting the entries up to a value vectorizes, which is ten times faster than keeping the k best.
    """
    batch, n, columns = distances.shape
    # Not np.empty: a row with NaN fills too few slots, but the rest must still be indices of points.
    chosen = np.zeros((batch * n, k), np.int32)
    _smallest_k(distances.reshape(batch * n, columns), k, chosen)
    return chosen.reshape(batch, n, k)


@njit(ahead="f2 l i2", **OVER_CLOUDS)
def _smallest_k(rows, k, chosen):
    for i in prange(len(rows)):
        row = rows[i]
        below, above, count = _bracket(row, k)
        if count == k:
            _collect_up_to(row, above, chosen[i])
        else:
            _collect_with_ties(row, below, above, chosen[i])


@njit(cache=True, error_model="numpy")
def _bracket(row, k):
    """Return (below, above, count): fewer than k entries are <= below, count >= k are <= above.

    Interpolates the counts, as distances are about evenly spread, or bisects where that gains less than half.
    """
    half = row.dtype.type(0.5)
    above = below = row[0]
    for j in range(1, k):
        above = max(above, row[j])
        below = min(below, row[j])
    count, fewer = _count(row, above), _count(row, below)
    step = (above - below) / row.dtype.type(16) if above > below else row.dtype.type(1)
    while fewer >= k:
        above, count = below, fewer
        below, step = above - step, step + step
        if below < above:  # else the step is lost in rounding
            fewer = _count(row, below)
        elif not step < np.inf:
            break
    halve = False
    while count != k:
        width = above - below
        middle = below + width * (half if halve else row.dtype.type((k - fewer) / (count - fewer)))
        if not below < middle < above:
            middle = below + width * half
            if not below < middle < above:
                break
        within = _count(row, middle)
        if within >= k:
            above, count = middle, within
        else:
            below, fewer = middle, within
        halve = above - below > half * width
    return below, above, count


@njit(cache=True, error_model="numpy")
def _count(row, most):
    within = np.int32(0)
    for j in range(row.size):  # iterating over the row itself would not vectorize
        within += np.int32(row[j] <= most)
    return within


@njit(cache=True, error_model="numpy")
def _collect_up_to(row, above, out):
    filled = 0
    for j in range(row.size):
        # Written always, kept only when within: no branch to mispredict.
        out[min(filled, out.size - 1)] = j
        filled += row[j] <= above
        if filled == out.size:
            break


@njit(cache=True, error_model="numpy")
def _collect_with_ties(row, below, above, out):
    filled = 0
    for j in range(row.size):
        if filled < out.size and row[j] <= below:  # more than fit, where they are -inf
            out[filled] = j
            filled += 1
    for j in range(row.size):
        if filled < out.size and below < row[j] <= above:
            out[filled] = j
            filled += 1


def gather_extreme_and_sums(ac: np.ndarray, neighbors: np.ndarray, gamma: np.ndarray) -> tuple[np.ndarray, ...]:
    """Pass once over all edges y_ij = A_j + C_i: extreme, extreme_at, edge_sums (B, N, F), mean and variance (F,).

    The extreme is max_j y_ij where gamma >= 0 and min_j y_ij elsewhere, reached at the point j; edge_sums are Σ_j y_ij.
    Mean and biased variance are over all B·N·k edges, in float64.
    """
    shape = (*neighbors.shape[:2], len(gamma))
    filled = np.empty(shape, ac.dtype), np.empty(shape, np.int32), np.empty(shape, ac.dtype)
    mean, variance = np.zeros((2, len(gamma)))
    _gather_extreme_and_sums(ac, neighbors, np.where(gamma >= 0, 1, -1).astype(ac.dtype), *filled, mean, variance)
    return *filled, mean, variance


@njit(ahead="f3 i3 f1 f3 i3 f3 d1 d1", **OVER_CLOUDS)
def _gather_extreme_and_sums(ac, neighbors, sign, extreme, extreme_at, edge_sums, mean, variance):
    batch, n, k = neighbors.shape
    features = len(sign)
    sums, squares = np.zeros((batch, features)), np.zeros((batch, features))
    for b in prange(batch):
        square = np.empty(features, ac.dtype)
        for i in range(n):
            c = ac[b, i, features:]
            best, best_at, total = extreme[b, i], extreme_at[b, i], edge_sums[b, i]
            first = neighbors[b, i, 0]
            a = ac[b, first, :features]
            for f in range(features):
                y = a[f] + c[f]
                best[f], best_at[f], total[f], square[f] = y * sign[f], first, y, y * y
            for slot in range(1, k):
                j = neighbors[b, i, slot]
                a = ac[b, j, :features]
                for f in range(features):
                    y = a[f] + c[f]
                    total[f] += y
                    square[f] += y * y
                    signed = y * sign[f]
                    better = signed > best[f]
                    best[f] = signed if better else best[f]
                    best_at[f] = j if better else best_at[f]
            for f in range(features):
                best[f] *= sign[f]
                sums[b, f] += total[f]
                squares[b, f] += square[f]
    edges = batch * n * k
    for f in range(features):
        for b in range(batch):
            mean[f] += sums[b, f] / edges
            variance[f] += squares[b, f] / edges
        variance[f] = np.maximum(variance[f] - mean[f] * mean[f], 0.0)


def normalize_activate(extreme: np.ndarray, *others: np.ndarray | float) -> np.ndarray:
    """Return act(γ (extreme - μ)/σ + β), the layer's output (B, N, F), by μ, 1/σ, γ, β and the slope."""
    out = np.empty_like(extreme)
    _normalize_activate(extreme, *others, out)
    return out


@njit(ahead="f3 f1 f1 f1 f1 d f3", **OVER_CLOUDS)
def _normalize_activate(extreme, mean, inverse_std, gamma, beta, slope, out):
    batch, n, features = extreme.shape
    scale, shift = np.empty_like(gamma), np.empty_like(gamma)
    for f in range(features):
        scale[f] = gamma[f] * inverse_std[f]
        shift[f] = beta[f] - scale[f] * mean[f]
    slope = extreme.dtype.type(slope)
    for b in prange(batch):
        for i in range(n):
            for f in range(features):
                z = extreme[b, i, f] * scale[f] + shift[f]
                out[b, i, f] = z if z > 0 else slope * z


def gather_max_affine(ac: np.ndarray, *others: np.ndarray | float) -> np.ndarray:
    """Return max_j act(scale · (A_j + C_i) + shift), (B, N, F), by the neighbors, scale, shift and slope."""
    out = np.empty((*ac.shape[:2], ac.shape[2] // 2), ac.dtype)
    _gather_max_affine(ac, *others, out)
    return out


@njit(ahead="f3 i3 f1 f1 d f3", **OVER_CLOUDS)
def _gather_max_affine(ac, neighbors, scale, shift, slope, out):
    batch, n, k = neighbors.shape
    features = len(scale)
    slope = ac.dtype.type(slope)
    for b in prange(batch):
        scaled = np.empty((n, features), ac.dtype)
        for i in range(n):
            for f in range(features):
                scaled[i, f] = scale[f] * ac[b, i, f]
        for i in range(n):
            best = out[b, i]
            for f in range(features):
                best[f] = scaled[neighbors[b, i, 0], f]
            for slot in range(1, k):
                a = scaled[neighbors[b, i, slot]]
                for f in range(features):
                    best[f] = max(best[f], a[f])
            for f in range(features):
                z = best[f] + scale[f] * ac[b, i, features + f] + shift[f]
                best[f] = z if z > 0 else slope * z


def edge_max_backward(grad_out: np.ndarray, ac: np.ndarray, *others: np.ndarray | float) -> tuple[np.ndarray, ...]:
    """Return grad_ac (B, N, 2F), grad_gamma (F,), grad_beta (F,) of :func:`normalize_activate`.

    With g the gradient at the extreme edges and ŷ the normalized edges, batch norm over E edges gives

        ∂L/∂y_e = γ/σ [ g_e - (Σ g + ŷ_e Σ g ŷ)/E ] ;

    summed over the edges that leave i it is ∂L/∂C_i, over those that arrive at j it is ∂L/∂A_j.
    """
    grad_ac, (grad_gamma, grad_beta) = np.empty_like(ac), np.zeros((2, ac.shape[2] // 2))
    _edge_max_backward(grad_out, ac, *others, grad_ac, grad_gamma, grad_beta)
    return grad_ac, grad_gamma.astype(ac.dtype), grad_beta.astype(ac.dtype)


@njit(ahead="f3 f3 i3 f3 i3 f3 f1 f1 f1 f3 l d f3 d1 d1", **OVER_CLOUDS)
def _edge_max_backward(
    grad_out, ac, neighbors, extreme, extreme_at, edge_sums, mean, inverse_std, gamma, out, n_edges, slope,
    grad_ac, grad_gamma, grad_beta,
):  # fmt: skip
    batch, n, k = neighbors.shape
    features = gamma.shape[0]
    dtype = ac.dtype
    slope = dtype.type(slope)
    grad = np.empty((batch, n, features), dtype)
    gamma_parts, beta_parts = np.zeros((batch, features)), np.zeros((batch, features))
    for b in prange(batch):
        for i in range(n):
            for f in range(features):
                g = grad_out[b, i, f] * (dtype.type(1) if out[b, i, f] > 0 else slope)
                grad[b, i, f] = g
                beta_parts[b, f] += g
                gamma_parts[b, f] += g * ((extreme[b, i, f] - mean[f]) * inverse_std[f])
    # per edge: γ/σ [ g - (β' + (y - μ)/σ γ')/E ]  =  scale g - constant - linear y
    scale, linear, constant = np.empty(features, dtype), np.empty(features, dtype), np.empty(features, dtype)
    for f in range(features):
        for b in range(batch):
            grad_gamma[f] += gamma_parts[b, f]
            grad_beta[f] += beta_parts[b, f]
        scale[f] = gamma[f] * inverse_std[f]
        linear[f] = scale[f] * inverse_std[f] * grad_gamma[f] / n_edges
        constant[f] = dtype.type(scale[f] * grad_beta[f] / n_edges) - linear[f] * mean[f]
    for b in prange(batch):
        degree = np.zeros(n, np.int32)
        arriving_c, selected = np.zeros((n, features), dtype), np.zeros((n, features), dtype)
        for i in range(n):
            c = ac[b, i, features:]
            for slot in range(k):
                j = neighbors[b, i, slot]
                degree[j] += 1
                row = arriving_c[j]
                for f in range(features):
                    row[f] += c[f]
            for f in range(features):
                selected[extreme_at[b, i, f], f] += grad[b, i, f]
        for i in range(n):
            arrivals, leaving = dtype.type(degree[i]), dtype.type(k)
            for f in range(features):
                arriving_y = arrivals * ac[b, i, f] + arriving_c[i, f]
                grad_ac[b, i, f] = scale[f] * selected[i, f] - arrivals * constant[f] - linear[f] * arriving_y
                grad_ac[b, i, features + f] = (
                    scale[f] * grad[b, i, f] - leaving * constant[f] - linear[f] * edge_sums[b, i, f]
                )
