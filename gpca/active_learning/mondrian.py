"""Mondrian forests (Lakshminarayanan et al. 2014): random trees that grow with a stream and recognize unseen regions.

A Mondrian tree splits a box by a clock: the next split comes after a time drawn from an exponential distribution whose
rate is the sum of the box's sides. A sample outside of a box may split off above it, at the time and place at which a
tree grown on all samples at once would have split, so the order of arrival does not matter.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

DISCOUNT = 10.0  # per dimension: how fast a box forgets what is above it, as the authors have it


@dataclass
class Node:
    """A box of the samples below it.

    Attributes:
        low_D, high_D: its corners.
        time: of its split; infinite where it is a leaf.
        counts_C: of its samples by class; above the leaves, of the children that have the class.
        axis, place: where it is split.
        children: those below and above the place; none of a leaf.
        x_N_D, label_N: the samples of a leaf.
    """

    low_D: np.ndarray
    high_D: np.ndarray
    time: float
    counts_C: np.ndarray
    axis: int = -1
    place: float = 0.0
    children: tuple[Node, Node] | None = None
    x_N_D: np.ndarray = field(default_factory=lambda: np.empty((0, 0)))
    label_N: np.ndarray = field(default_factory=lambda: np.empty(0, int))


class MondrianForest:
    """T Mondrian trees over inputs of D dimensions and C classes; without a sample all classes are alike.

    Args:
        classes: C.
        random: of the splits.
        trees: T.
    """

    def __init__(self, classes: int, random: np.random.Generator, trees: int) -> None:
        self._classes = classes
        self._random = random
        self._roots: list[Node] = []
        self._trees = trees

    def learn(self, x_N_D: np.ndarray, label_N: np.ndarray) -> None:
        """Let every tree grow by samples and their classes."""
        if not self._roots:
            self._roots = [self._block(x_N_D, label_N, 0.0) for _ in range(self._trees)]
            return
        for x_D, label in zip(x_N_D, label_N, strict=True):
            self._roots = [self._extended(root, 0.0, x_D, int(label)) for root in self._roots]

    def scores(self, x_N_D: np.ndarray) -> np.ndarray:
        """Return the class probabilities (N, C), means over the trees."""
        uniform_C = np.full(self._classes, 1 / self._classes)
        if not self._roots:
            return np.tile(uniform_C, (len(x_N_D), 1))
        total_N_C = np.zeros((len(x_N_D), self._classes))
        for root in self._roots:
            _descend(root, 0.0, uniform_C, x_N_D, np.ones(len(x_N_D)), np.arange(len(x_N_D)), total_N_C)
        return total_N_C / len(self._roots)

    def _block(self, x_N_D: np.ndarray, label_N: np.ndarray, earlier: float) -> Node:
        """Return a new tree of samples; it waits ("pauses") where all are of one class."""
        low_D, high_D = x_N_D.min(axis=0), x_N_D.max(axis=0)
        sides_D = high_D - low_D
        if (label_N == label_N[0]).all() or not sides_D.any():
            counts_C = np.bincount(label_N, minlength=self._classes)
            return Node(low_D, high_D, np.inf, counts_C, x_N_D=x_N_D, label_N=label_N)
        time, axis = self._next_split(earlier, sides_D)
        place = self._random.uniform(low_D[axis], high_D[axis])
        above_N = x_N_D[:, axis] > place
        lower, upper = (self._block(x_N_D[here_N], label_N[here_N], time) for here_N in (~above_N, above_N))
        return Node(low_D, high_D, time, _tables(lower) + _tables(upper), axis, place, (lower, upper))

    def _extended(self, node: Node, earlier: float, x_D: np.ndarray, label: int) -> Node:
        """Return the node that stands where this one stood, after a sample has joined; `earlier` is its parent's time.

        A leaf of one class goes on waiting for a sample of its own class, and is drawn anew with one of another.
        """
        if node.children is None:
            return self._block(np.vstack([node.x_N_D, x_D]), np.append(node.label_N, label), earlier)
        outside_D = np.maximum(node.low_D - x_D, 0) + np.maximum(x_D - node.high_D, 0)
        low_D, high_D = np.minimum(node.low_D, x_D), np.maximum(node.high_D, x_D)
        if outside_D.any():
            time, axis = self._next_split(earlier, outside_D)
            if time < node.time:
                leaf = self._block(x_D[None], np.array([label]), time)
                is_above = x_D[axis] > node.high_D[axis]
                ends = (node.high_D[axis], x_D[axis]) if is_above else (x_D[axis], node.low_D[axis])
                pair = (node, leaf) if is_above else (leaf, node)
                counts_C = _tables(node) + _tables(leaf)
                return Node(low_D, high_D, time, counts_C, axis, self._random.uniform(*ends), pair)
        lower, upper = node.children
        if x_D[node.axis] > node.place:
            upper = self._extended(upper, node.time, x_D, label)
        else:
            lower = self._extended(lower, node.time, x_D, label)
        counts_C = _tables(lower) + _tables(upper)
        return Node(low_D, high_D, node.time, counts_C, node.axis, node.place, (lower, upper))

    def _next_split(self, earlier: float, sides_D: np.ndarray) -> tuple[float, int]:
        """Return when and across which axis a box of these sides is split next."""
        rate = sides_D.sum()
        return earlier + self._random.exponential(1 / rate), int(self._random.choice(len(sides_D), p=sides_D / rate))


def _tables(node: Node) -> np.ndarray:
    """Return the classes that a node has: one table each in the hierarchy of its posterior."""
    return np.minimum(node.counts_C, 1)


def _descend(
    node: Node,
    earlier: float,
    parent_C: np.ndarray,
    x_N_D: np.ndarray,
    staying_N: np.ndarray,
    rows_N: np.ndarray,
    total_R_C: np.ndarray,
) -> None:
    """Add to `total_R_C[rows_N]` the probabilities that the samples get from a node and all below it.

    At every box a sample may split off, with a probability that grows with its distance outside, and then gets the
    box's classes mixed with those of the parent; the share that is left at the end gets the classes of its leaf.

    Args:
        earlier: time of the node's parent.
        parent_C: posterior mean of the parent.
        staying_N: probability that a sample has not split off above.
    """
    discount = DISCOUNT * x_N_D.shape[1]
    lasting = node.time - earlier
    tables_C = _tables(node)
    outside_N = (np.maximum(node.low_D - x_N_D, 0) + np.maximum(x_N_D - node.high_D, 0)).sum(axis=1)
    inside_N = outside_N == 0
    rate_N = np.where(inside_N, 1.0, outside_N)
    off_N = np.where(inside_N, 0.0, -np.expm1(-lasting * rate_N))
    # The expected discount over the time of splitting off, which is exponential and ends with that of the node.
    both_N = rate_N + discount
    kept_N = np.where(inside_N, 0.0, rate_N / both_N * np.expm1(-lasting * both_N) / np.expm1(-lasting * rate_N))
    off_N_C = tables_C + kept_N[:, None] * (tables_C.sum() * parent_C - tables_C)
    total_R_C[rows_N] += (staying_N * off_N)[:, None] * off_N_C / tables_C.sum()
    staying_N = staying_N * (1 - off_N)
    own_C = node.counts_C + np.exp(-discount * lasting) * (tables_C.sum() * parent_C - tables_C)
    own_C /= node.counts_C.sum()
    if node.children is None:
        total_R_C[rows_N] += staying_N[:, None] * own_C
        return
    is_above_N = x_N_D[:, node.axis] > node.place
    for child, here_N in zip(node.children, (~is_above_N, is_above_N), strict=True):
        if here_N.any():
            _descend(child, node.time, own_C, x_N_D[here_N], staying_N[here_N], rows_N[here_N], total_R_C)
