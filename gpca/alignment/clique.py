"""The largest clique of a graph: the largest set of correspondences of which every two agree."""

from __future__ import annotations

import numpy as np

MOST_BRANCHES = 20_000  # then the best so far is taken: counted, not timed, so that it is the same on every machine


def largest_clique(adjacent_n_n: np.ndarray, most_branches: int = MOST_BRANCHES) -> tuple[np.ndarray, bool]:
    """Return the nodes of the largest clique, sorted, and whether it is certain that none is larger.

    Branch and bound over sets of bits, bounded by greedy colors (Tomita & Seki 2003; San Segundo et al. 2011).

    Args:
        adjacent_n_n: symmetric; what is on the diagonal does not matter.
        most_branches: limit of the search.
    """
    adjacent_n_n = adjacent_n_n & ~np.eye(len(adjacent_n_n), dtype=bool)
    order = np.argsort(-adjacent_n_n.sum(axis=1), kind="stable")  # colors are given to nodes of many neighbors first
    packed = np.packbits(adjacent_n_n[np.ix_(order, order)], axis=1, bitorder="little")
    neighbours = [int.from_bytes(row.tobytes(), "little") for row in packed]

    best: list[int] = []
    path: list[int] = []  # the clique so far; for it and each of its beginnings, what may come next:
    candidates = [(1 << len(order)) - 1]
    branches = [_colored(candidates[0], neighbours)]
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
        further = candidates[-1] & neighbours[node]
        if further:
            path.append(node)
            candidates.append(further)
            branches.append(_colored(further, neighbours))
        elif len(path) >= len(best):
            best = [*path, node]
    return np.sort(order[best]), tried < most_branches


def _colored(candidates: int, neighbours: list[int]) -> list[tuple[int, int]]:
    """Give each candidate a color, no two neighbors the same, and list both by color.

    A clique among the candidates up to any place in the list has no more nodes than the color there.
    """
    colored, colour = [], 0
    while candidates:
        colour += 1
        free = candidates
        while free:
            node = (free & -free).bit_length() - 1
            free &= ~(neighbours[node] | 1 << node)
            candidates ^= 1 << node
            colored.append((node, colour))
    return colored
