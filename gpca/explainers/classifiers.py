"""Scikit-learn classifiers of concepts or causes on a few numbers, and boosted trees as arrays for model files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gpca.errors import InputError
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import seed_of

PAPERS_RANDOM_STATE = 42  # of the forest and of the linear SVM in Table V
LEAF = -1  # in place of a leaf's feature


def scores_of(classifier, features_N_F: np.ndarray, labels: tuple[str, ...] = CONCEPTS) -> np.ndarray:
    """Return a fitted classifier's probabilities (N, C) in the order of the labels; 0 for one absent from training."""
    scores_N_C = np.zeros((len(features_N_F), len(labels)))
    scores_N_C[:, [labels.index(label) for label in classifier.classes_]] = classifier.predict_proba(features_N_F)
    return scores_N_C


def known_concepts(concept_N: np.ndarray, labels: tuple[str, ...] = CONCEPTS) -> list[str]:
    """Return the labels that occur in training, in their order; fewer than two raise an InputError."""
    present = [label for label in labels if label in concept_N]
    if len(present) < 2:
        raise InputError("training registrations", "cover fewer than two concepts", "give samples of at least two")
    return present


def standardized_regression(inverse_regularisation: float):
    """Return an unfitted multinomial logistic regression on standardized features (L2, scikit-learn's C)."""
    from sklearn.linear_model import LogisticRegression
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    return make_pipeline(StandardScaler(), LogisticRegression(C=inverse_regularisation, max_iter=1000))


def boosted_trees(
    *axes: object, iterations: int = 150, learning_rate: float = 0.06, monotonic: Sequence[int] | None = None
):
    """Return unfitted gradient boosting on histograms (Ke et al. 2017); the axes name its random numbers."""
    from sklearn.ensemble import HistGradientBoostingClassifier

    return HistGradientBoostingClassifier(
        learning_rate=learning_rate,
        max_iter=iterations,
        min_samples_leaf=8,
        l2_regularization=1.0,
        max_features=0.3,
        early_stopping=False,
        monotonic_cst=monotonic,
        random_state=seed_of(*axes, "boosted trees") % 2**32,
    )


@dataclass(frozen=True)
class BoostedQuestion:
    """Boosted trees for a binary question, evaluated without scikit-learn; a node's left child is the next node."""

    baseline: float  # log odds before any tree
    roots: np.ndarray  # (T,) root node of each tree
    feature: np.ndarray  # (n,) compared feature; `LEAF` at a leaf
    number: np.ndarray  # (n,) threshold, at or below which the left child follows; log odds at a leaf
    right: np.ndarray  # (n,) right child; a leaf itself at a leaf

    @classmethod
    def fit(
        cls, inputs_N_F: np.ndarray, yes_N: np.ndarray, *axes: object, monotonic: Sequence[int] | None = None
    ) -> BoostedQuestion:
        """Learn from samples (N, F) and their answers; see :func:`boosted_trees`."""
        if yes_N.all() or not yes_N.any():  # a single class: smoothed odds without trees
            return cls(float(np.log((yes_N.sum() + 1) / ((~yes_N).sum() + 1))), *_joined([]))
        fitted = boosted_trees(*axes, monotonic=monotonic).fit(inputs_N_F, yes_N)
        trees = [predictor.nodes for (predictor,) in fitted._predictors]
        return cls(float(fitted._baseline_prediction[0, 0]), *_joined(trees))

    def probability(self, inputs_N_F: np.ndarray) -> np.ndarray:
        from scipy.special import expit

        return expit(self.log_odds(inputs_N_F))

    def log_odds(self, inputs_N_F: np.ndarray) -> np.ndarray:
        at_N_T = np.repeat(self.roots[None], len(inputs_N_F), axis=0)
        while (inner_N_T := self.feature[at_N_T] != LEAF).any():
            rows, columns = np.nonzero(inner_N_T)
            nodes = at_N_T[rows, columns]
            left = inputs_N_F[rows, self.feature[nodes]] <= self.number[nodes]
            at_N_T[rows, columns] = np.where(left, nodes + 1, self.right[nodes])
        return self.baseline + self.number[at_N_T].sum(axis=1)


def require_trees(state: dict, features: int) -> None:
    """Raise a ValueError unless these fields of a :class:`BoostedQuestion` are trees that end, on so many features."""
    parts = roots, feature, number, right = [state[name] for name in ("roots", "feature", "number", "right")]
    kinds = (np.int32, np.int16, np.float64, np.int32)
    if any(part.ndim != 1 or part.dtype != kind for part, kind in zip(parts, kinds, strict=True)):
        raise ValueError("its trees have parts of a different shape or type")
    n = len(feature)
    if type(state["baseline"]) is not float or not abs(state["baseline"]) < float("inf"):
        raise ValueError("the baseline of its trees is not a number")
    if len(number) != n or len(right) != n or not ((roots >= 0) & (roots < n)).all():
        raise ValueError("its trees have nodes that are missing")
    if not ((feature >= LEAF) & (feature < features)).all():
        raise ValueError("its trees ask for features that there are not")
    node = np.arange(n)
    if not np.where(feature == LEAF, right == node, (right > node) & (right < n)).all():
        raise ValueError("its trees do not end")


def _joined(trees: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return roots, feature, number and right of scikit-learn's trees, whose left child is always the next node."""
    sizes = [len(nodes) for nodes in trees]
    roots = np.cumsum([0, *sizes])[:-1]
    fields = ("is_leaf", "feature_idx", "value", "num_threshold", "right")
    nodes = np.concatenate(trees) if trees else np.empty(0, [(name, np.float64) for name in fields])
    first_n = np.repeat(roots, sizes)
    is_leaf = nodes["is_leaf"] == 1
    feature = np.where(is_leaf, LEAF, nodes["feature_idx"])
    number = np.where(is_leaf, nodes["value"], nodes["num_threshold"])
    right = np.where(is_leaf, np.arange(len(nodes)), first_n + nodes["right"])
    return roots.astype(np.int32), feature.astype(np.int16), number.astype(np.float64), right.astype(np.int32)
