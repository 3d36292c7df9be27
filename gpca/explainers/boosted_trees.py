"""Gradient boosting of trees: the settings that all who boost here share, and a form of plain arrays for model files.

scikit-learn fits the trees. To ask them takes none of it, which would load for a second, and a file with them holds
numbers alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gpca.seeds import seed_of

LEAF = -1  # in the place of a leaf's feature


def boosted_trees(*axes: object, iterations: int = 150, learning_rate: float = 0.06):
    """Return unfitted gradient boosting on histograms (Ke et al. 2017); the axes name its draws."""
    from sklearn.ensemble import HistGradientBoostingClassifier

    return HistGradientBoostingClassifier(
        learning_rate=learning_rate,
        max_iter=iterations,
        min_samples_leaf=8,
        l2_regularization=1.0,
        max_features=0.3,
        early_stopping=False,
        random_state=seed_of(*axes, "boosted trees") % 2**32,
    )


@dataclass(frozen=True)
class BoostedQuestion:
    """Boosted trees for a question with two answers. Nodes of all trees follow each other, each before its branches.

    Attributes:
        baseline: log odds before any tree.
        roots: (T,) the first node of each tree.
        feature: (n,) that a node asks for; `LEAF` of a leaf.
        number: (n,) up to which one goes to the left, which is the next node; of a leaf its log odds.
        right: (n,) the node on the right; of a leaf the leaf itself.
    """

    baseline: float
    roots: np.ndarray
    feature: np.ndarray
    number: np.ndarray
    right: np.ndarray

    @classmethod
    def fit(cls, inputs_N_F: np.ndarray, yes_N: np.ndarray, *axes: object) -> BoostedQuestion:
        """Learn from samples (N, F) which of them get the answer yes; the axes name the draws."""
        if yes_N.all() or not yes_N.any():  # nothing to be told apart
            return cls(float(np.log((yes_N.sum() + 1) / ((~yes_N).sum() + 1))), *_joined([]))
        fitted = boosted_trees(*axes).fit(inputs_N_F, yes_N)
        trees = [predictor.nodes for (predictor,) in fitted._predictors]
        return cls(float(fitted._baseline_prediction[0, 0]), *_joined(trees))

    def probability(self, inputs_N_F: np.ndarray) -> np.ndarray:
        """Return the probability of yes (N,)."""
        from scipy.special import expit

        at_N_T = np.repeat(self.roots[None], len(inputs_N_F), axis=0)
        while (asking_N_T := self.feature[at_N_T] != LEAF).any():
            rows, columns = np.nonzero(asking_N_T)
            nodes = at_N_T[rows, columns]
            left = inputs_N_F[rows, self.feature[nodes]] <= self.number[nodes]
            at_N_T[rows, columns] = np.where(left, nodes + 1, self.right[nodes])
        return expit(self.baseline + self.number[at_N_T].sum(axis=1))

    def state(self) -> dict[str, object]:
        """Return numbers and tensors, for :meth:`from_state`."""
        import torch

        arrays = {name: torch.from_numpy(getattr(self, name)) for name in ("roots", "feature", "number", "right")}
        return {"baseline": self.baseline, **arrays}

    @classmethod
    def from_state(cls, state: dict) -> BoostedQuestion:
        """Return the trees of a :meth:`state`."""
        arrays = {name: state[name].numpy() for name in ("roots", "feature", "number", "right")}
        return cls(baseline=state["baseline"], **arrays)


def require_trees(state: dict, features: int) -> None:
    """Raise a ValueError unless a :meth:`BoostedQuestion.state` is one of trees that end, on so many features."""
    import torch

    parts = roots, feature, number, right = [state[name] for name in ("roots", "feature", "number", "right")]
    kinds = (torch.int32, torch.int16, torch.float64, torch.int32)
    if any(part.ndim != 1 or part.dtype != kind for part, kind in zip(parts, kinds, strict=True)):
        raise ValueError("its trees have parts of a different shape or type")
    n = len(feature)
    if type(state["baseline"]) is not float or not abs(state["baseline"]) < float("inf"):
        raise ValueError("the baseline of its trees is not a number")
    if len(number) != n or len(right) != n or not ((roots >= 0) & (roots < n)).all():
        raise ValueError("its trees have nodes that are missing")
    if not ((feature >= LEAF) & (feature < features)).all():
        raise ValueError("its trees ask for features that there are not")
    own = torch.arange(n)
    if not torch.where(feature == LEAF, right == own, (right > own) & (right < n)).all():
        raise ValueError("its trees do not end")


def _joined(trees: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return roots, feature, number and right of scikit-learn's trees, whose left branch is always the next node."""
    sizes = [len(nodes) for nodes in trees]
    roots = np.cumsum([0, *sizes])[:-1]
    nodes = np.concatenate(trees) if trees else np.empty(0, [(name, np.float64) for name in _FIELDS])
    first_n = np.repeat(roots, sizes)
    is_leaf = nodes["is_leaf"] == 1
    feature = np.where(is_leaf, LEAF, nodes["feature_idx"])
    number = np.where(is_leaf, nodes["value"], nodes["num_threshold"])
    right = np.where(is_leaf, np.arange(len(nodes)), first_n + nodes["right"])
    return roots.astype(np.int32), feature.astype(np.int16), number.astype(np.float64), right.astype(np.int32)


_FIELDS = ("is_leaf", "feature_idx", "value", "num_threshold", "right")
