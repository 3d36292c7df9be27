"""Models of the stream learners beside GP-CA: a Mondrian forest and a Bayesian last layer."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations_with_replacement

import numpy as np
from scipy.special import softmax

from gpca.classifier.scores import summarize_draws

DISCOUNT = 10.0  # per dimension: rate at which a box forgets its parents, as in the authors' code
NEWTON_STEPS = 20
TOLERANCE = 1e-10  # of a logit


@dataclass
class Node:
    """A box of the samples below it."""

    low_D: np.ndarray
    high_D: np.ndarray
    time: float  # of the split; infinity for leaves
    counts_C: np.ndarray  # samples per class in a leaf; elsewhere, number of children with the class
    axis: int = -1
    place: float = 0.0
    children: tuple[Node, Node] | None = None  # below and above the split; None for leaves
    x_N_D: np.ndarray = field(default_factory=lambda: np.empty((0, 0)))  # samples of a leaf
    label_N: np.ndarray = field(default_factory=lambda: np.empty(0, int))


class MondrianForest:
    """A Mondrian forest of T trees over D dimensions and C classes (Lakshminarayanan et al. 2014).

    A Mondrian tree splits a box at random times: the next split comes after a time drawn from an exponential
    distribution whose rate is the sum of the box's sides. A sample outside of a box may split off above it, as in a
    tree grown on all samples at once, so that the order of arrival does not matter.
    """

    def __init__(self, classes: int, random: np.random.Generator, trees: int) -> None:
        self._classes, self._random, self._trees = classes, random, trees
        self._roots: list[Node] = []

    def learn(self, x_N_D: np.ndarray, label_N: np.ndarray) -> None:
        """Add samples and their classes to every tree."""
        if not self._roots:
            self._roots = [self._block(x_N_D, label_N, 0.0) for _ in range(self._trees)]
            return
        for x_D, label in zip(x_N_D, label_N, strict=True):
            self._roots = [self._extended(root, 0.0, x_D, int(label)) for root in self._roots]

    def scores(self, x_N_D: np.ndarray) -> np.ndarray:
        """Return the class probabilities (N, C), averaged over the trees."""
        uniform_C = np.full(self._classes, 1 / self._classes)
        total_N_C = np.zeros((len(x_N_D), self._classes))
        for root in self._roots:
            _descend(root, 0.0, uniform_C, x_N_D, np.ones(len(x_N_D)), np.arange(len(x_N_D)), total_N_C)
        return total_N_C / len(self._roots)

    def _block(self, x_N_D: np.ndarray, label_N: np.ndarray, earlier: float) -> Node:
        """Return a new tree of samples; nodes of a single class are not split ("paused")."""
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
        """Return the node that replaces this one after a new sample; the parent's split was earlier.

        A leaf of one class stays paused for samples of its class, and is drawn again for others.
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
        """Return time and axis of the next split of a box with these sides."""
        rate = sides_D.sum()
        return earlier + self._random.exponential(1 / rate), int(self._random.choice(len(sides_D), p=sides_D / rate))


def _tables(node: Node) -> np.ndarray:
    """Return the classes of a node: one table each in the hierarchy of its posterior."""
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
    """Add the class probabilities of samples at a node and below it to `total_R_C[rows_N]`.

    At every box, a sample may split off with a probability that grows with its distance outside; it then gets the
    classes of the box mixed with the parent's, whose posterior mean is `parent_C`. The remaining share gets the classes
    of the leaf. `staying_N` is the probability that a sample has not split off above.
    """
    discount = DISCOUNT * x_N_D.shape[1]
    lasting = node.time - earlier
    tables_C = _tables(node)
    outside_N = (np.maximum(node.low_D - x_N_D, 0) + np.maximum(x_N_D - node.high_D, 0)).sum(axis=1)
    inside_N = outside_N == 0
    rate_N = np.where(inside_N, 1.0, outside_N)
    off_N = np.where(inside_N, 0.0, -np.expm1(-lasting * rate_N))
    # Expected discount over the exponential time of splitting off, up to the time of the node.
    both_N = rate_N + discount
    kept_N = np.where(inside_N, 0.0, rate_N / both_N * np.expm1(-lasting * both_N) / np.expm1(-lasting * rate_N))
    off_N_C = tables_C + kept_N[:, None] * (tables_C.sum() * parent_C - tables_C)
    total_R_C[rows_N] += (staying_N * off_N)[:, None] * off_N_C / tables_C.sum()
    staying_N = staying_N * (1 - off_N)
    mean_C = node.counts_C + np.exp(-discount * lasting) * (tables_C.sum() * parent_C - tables_C)
    mean_C /= node.counts_C.sum()
    if node.children is None:
        total_R_C[rows_N] += staying_N[:, None] * mean_C
        return
    is_above_N = x_N_D[:, node.axis] > node.place
    for child, here_N in zip(node.children, (~is_above_N, is_above_N), strict=True):
        if here_N.any():
            _descend(child, node.time, mean_C, x_N_D[here_N], staying_N[here_N], rows_N[here_N], total_R_C)


class BayesianLayer:
    """Softmax regression on fixed features with a Gaussian posterior over its weights (C, F), updated label by label.

    The posterior after a label is the prior of the next: Laplace's approximation with generalized Gauss-Newton
    curvature (Daxberger et al. 2021). A label changes the curvature by a matrix of rank C, so that the logits of its
    sample determine the new weights in C dimensions (extended Kalman filter of Bayesian continual learning).

    A constant is added to the F - 1 features; where they have unit variance, `deviation` is a logit's by the prior.
    """

    def __init__(self, width: int, classes: int, deviation: float) -> None:
        self._mean_C_F = np.zeros((classes, width + 1))
        size = classes * (width + 1)
        self._covariance_P_P = np.eye(size) * (deviation**2 / (width + 1))

    def learn(self, x_N_D: np.ndarray, label_N: np.ndarray) -> None:
        """Learn samples and their classes in order."""
        classes, width = self._mean_C_F.shape
        for features_F, label in zip(_with_constant(x_N_D), map(int, label_N), strict=True):
            before_C = self._mean_C_F @ features_F
            towards_P_C = (self._covariance_P_P.reshape(-1, classes, width) @ features_F).reshape(-1, classes)
            prior_C_C = np.einsum("cfd,f->cd", towards_P_C.reshape(classes, width, classes), features_F)
            logits_C, curvature_C_C = _settled(before_C, prior_C_C, label)
            # Gradient of the log likelihood at the new logits.
            gradient_C = np.eye(classes)[label] - softmax(logits_C)
            self._mean_C_F = self._mean_C_F + (towards_P_C @ gradient_C).reshape(classes, width)
            gain_C_C = curvature_C_C @ np.linalg.inv(np.eye(classes) + prior_C_C @ curvature_C_C)
            self._covariance_P_P -= towards_P_C @ gain_C_C @ towards_P_C.T

    def logits(self, x_N_D: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return mean (N, C) and covariance (N, C, C) of the logits."""
        features_N_F = _with_constant(x_N_D)
        classes, width = self._mean_C_F.shape
        spread_C_F_C_F = self._covariance_P_P.reshape(classes, width, classes, width)
        covariance_N_C_C = np.empty((len(features_N_F), classes, classes))
        for c, d in combinations_with_replacement(range(classes), 2):
            half_N_F = features_N_F @ spread_C_F_C_F[c, :, d]
            covariance_N_C_C[:, c, d] = covariance_N_C_C[:, d, c] = np.einsum("nf,nf->n", half_N_F, features_N_F)
        return features_N_F @ self._mean_C_F.T, covariance_N_C_C

    def attribute(self, x_N_D: np.ndarray, normal_M_C: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return scores, variances and BALD from draws of the logits by standard normal numbers."""
        mean_N_C, covariance_N_C_C = self.logits(x_N_D)
        root_N_C_C = np.linalg.cholesky(covariance_N_C_C + 1e-9 * np.eye(covariance_N_C_C.shape[1]))
        return summarize_draws(mean_N_C + np.einsum("ncd,md->mnc", root_N_C_C, normal_M_C))


def _settled(before_C: np.ndarray, prior_C_C: np.ndarray, label: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the most probable logits of a sample of this class under N(before, prior), and their curvature (C, C)."""
    wanted_C = np.eye(len(before_C))[label]
    logits_C = before_C
    for _ in range(NEWTON_STEPS):
        p_C = softmax(logits_C)
        curvature_C_C = np.diag(p_C) - np.outer(p_C, p_C)
        # Newton on -log p_label(f) + (f - before)ᵀ prior⁻¹ (f - before) / 2, multiplied by the prior.
        residual_C = logits_C - before_C - prior_C_C @ (wanted_C - p_C)
        step_C = np.linalg.solve(np.eye(len(p_C)) + prior_C_C @ curvature_C_C, residual_C)
        logits_C = logits_C - step_C
        if np.abs(step_C).max() < TOLERANCE:
            break
    p_C = softmax(logits_C)
    return logits_C, np.diag(p_C) - np.outer(p_C, p_C)


def _with_constant(x_N_D: np.ndarray) -> np.ndarray:
    return np.column_stack([x_N_D, np.ones(len(x_N_D))]).astype(float)
