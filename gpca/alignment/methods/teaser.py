"""TEASER (Yang et al. 2021): its decoupled solver, at a scale of 1, on mutual matches of FPFH features."""

import numpy as np

from gpca.alignment.features import MOST_NEIGHBORS, RADIUS, fpfh_of_pair, mutual_matches
from gpca.alignment.methods.interface import FEWEST, REACH, FailedRegistration, MethodEntry, Outcome, Pair
from gpca.rigid import best_rotation, rigid_motion, rotate

GROWTH = 1.4  # of the convexity parameter μ per iteration, as in the paper
MOST_ITERATIONS = 100
SETTLED = 1e-9  # relative change of the cost
MOST_BRANCHES = 20_000  # limit of the clique search: counted, not timed, to be the same on every machine


def solve(source_n_3: np.ndarray, target_n_3: np.ndarray, noise: float) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the pose and the rows of correspondences that agree within `noise`, or None if no three do."""
    from scipy.spatial.distance import cdist

    agreeing_n_n = np.abs(cdist(source_n_3, source_n_3) - cdist(target_n_3, target_n_3)) <= 2 * noise
    clique, _ = largest_clique(agreeing_n_n)
    if len(clique) < FEWEST:
        return None
    one, other = np.triu_indices(len(clique), 1)
    p_n_3, q_n_3 = source_n_3[clique], target_n_3[clique]
    R, _ = gnc_rotation(p_n_3[other] - p_n_3[one], q_n_3[other] - q_n_3[one], 2 * noise)
    shifts_n_3 = q_n_3 - rotate(R, p_n_3)
    shift_3 = [vote(shifts_n, noise) for shifts_n in shifts_n_3.T]
    inlier_n = (np.abs(shifts_n_3 - shift_3) <= noise).all(axis=1)
    return rigid_motion(R, shift_3), clique[inlier_n]


def gnc_rotation(source_m_3: np.ndarray, target_m_3: np.ndarray, bound: float) -> tuple[np.ndarray, np.ndarray]:
    """Minimize Σ min(|b - R a|², bound²) by graduated non-convexity (Yang et al. 2020): R, and weights (m,)."""
    limit = bound**2
    weights_m = np.ones(len(source_m_3))
    mu, before = 0.0, np.inf
    R = np.eye(3)
    for _ in range(MOST_ITERATIONS):
        R = best_rotation(source_m_3, target_m_3, weights_m)
        square_m = np.square(target_m_3 - rotate(R, source_m_3)).sum(axis=1)
        if not mu:
            if square_m.max() <= limit:  # nothing to reject
                break
            mu = limit / (2 * square_m.max() - limit)
        cost = float((weights_m * square_m).sum())
        upper, lower = (mu + 1) / mu * limit, mu / (mu + 1) * limit
        between_m = np.sqrt(limit * mu * (mu + 1) / np.maximum(square_m, lower)) - mu
        weights_m = np.where(square_m >= upper, 0.0, np.where(square_m <= lower, 1.0, between_m))
        if abs(cost - before) <= SETTLED * limit or not weights_m.any():
            break
        mu, before = GROWTH * mu, cost
    return R, weights_m


def vote(shifts_n: np.ndarray, bound: float) -> float:
    """Return the t that minimizes Σ min((s - t)², bound²) over shifts (n,): every set of inliers is tried."""
    events = np.sort(np.concatenate([shifts_n - bound, shifts_n + bound]))
    inlier_e_n = np.abs(shifts_n - (events[1:] + events[:-1])[:, None] / 2) <= bound
    inlier_e_n = inlier_e_n[inlier_e_n.any(axis=1)]
    counts_e = inlier_e_n.sum(axis=1)
    means_e = np.where(inlier_e_n, shifts_n, 0).sum(axis=1) / counts_e
    squares_e = np.where(inlier_e_n, np.square(shifts_n - means_e[:, None]), 0).sum(axis=1)
    return float(means_e[np.argmin(squares_e + (len(shifts_n) - counts_e) * bound**2)])


def largest_clique(adjacent_n_n: np.ndarray, most_branches: int = MOST_BRANCHES) -> tuple[np.ndarray, bool]:
    """Return the largest clique by branch and bound with greedy colors (Tomita & Seki 2003), and if it is certain."""
    adjacent_n_n = adjacent_n_n & ~np.eye(len(adjacent_n_n), dtype=bool)
    order = np.argsort(-adjacent_n_n.sum(axis=1), kind="stable")  # colors are given to nodes of many neighbors first
    packed = np.packbits(adjacent_n_n[np.ix_(order, order)], axis=1, bitorder="little")
    neighbors = [int.from_bytes(row.tobytes(), "little") for row in packed]

    best: list[int] = []
    path: list[int] = []  # the current clique; candidates and branches hold the continuations of each of its prefixes
    candidates = [(1 << len(order)) - 1]
    branches = [_colored(candidates[0], neighbors)]
    tried = 0
    while branches:
        if not branches[-1] or len(path) + branches[-1][-1][1] <= len(best) or tried >= most_branches:
            branches.pop()
            candidates.pop()
            path = path[:-1]
            continue
        tried += 1
        node, _ = branches[-1].pop()
        candidates[-1] ^= 1 << node
        further = candidates[-1] & neighbors[node]
        if further:
            path.append(node)
            candidates.append(further)
            branches.append(_colored(further, neighbors))
        elif len(path) >= len(best):
            best = [*path, node]
    return np.sort(order[best]), tried < most_branches


def _colored(candidates: int, neighbors: list[int]) -> list[tuple[int, int]]:
    """List (node, color) by color, neighbors apart; a clique up to an entry has at most as many nodes as its color."""
    colored, color = [], 0
    while candidates:
        color += 1
        free = candidates
        while free:
            node = (free & -free).bit_length() - 1
            free &= ~(neighbors[node] | 1 << node)
            candidates ^= 1 << node
            colored.append((node, color))
    return colored


def align(
    pair: Pair,
    feature_radius: float = RADIUS,
    noise: float = 0.05,
    most_matches: int = 300,
    correspondence_distance: float = REACH,
    feature_neighbors: int = MOST_NEIGHBORS,
) -> Outcome:
    """Return the pose on which most matches agree; `noise`, in diameters, bounds a right match's error."""
    _, features = fpfh_of_pair(pair, feature_radius, feature_neighbors)
    source_N_33, target_P_33 = (each.data.T for each in features)
    rows_n_2 = mutual_matches(source_N_33, target_P_33, most_matches)
    solution = solve(pair.source[rows_n_2[:, 0]], pair.target[rows_n_2[:, 1]], noise)
    if solution is None or len(solution[1]) < FEWEST:
        raise FailedRegistration(f"fewer than {FEWEST} correspondences agree")
    return Outcome.at(pair, solution[0], correspondence_distance)


METHODS = {"teaser": MethodEntry("TEASER's solver", align, is_global=True)}
