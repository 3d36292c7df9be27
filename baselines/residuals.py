"""Three plain numbers of a registration and an ordinary classifier: the rival that a referee asks for first.

Noise raises the forward residual (source to target), a missing part the backward residual (target to source), a poor
pose both, and the spread of the Monte-Carlo poses of ICP. Like GP-CA, the classifiers learn from the training labels.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Annotated

import numpy as np

from gpca.attribution.scores import Attribution
from gpca.explainers.classifiers import standardized_regression
from gpca.explainers.interface import ClassifierExplainer, ExplainerEntry, attached, measured
from gpca.pairs.dataset import Registrations
from gpca.seeds import seed_of
from gpca.settings import Bounds, Count, Positive

FLOOR = 1e-6  # variance, as that of the uncertainty itself: a thousandth of a radian or of the diameter, squared
OBSERVED = 0  # the condition of the uncertainty design that leaves the observed pair as it is
# Names and units of the three features for a reader, and the power in which the logarithm counts the quantity. The
# sixth root of a covariance's determinant is a variance, and its square root a deviation.
QUANTITIES = (
    ("distance from source to target", " d", 1),
    ("distance from target to source", " d", 1),
    ("deviation of the poses", "", 12),
)


class Residuals(ClassifierExplainer):
    """A classifier on log forward residual, log backward residual and the log-determinant of the pose covariance.

    Reads ``covariance`` (S, K, 6, 6), ``icp_calls``, ``seconds`` and ``icp_seconds`` (S, K), of which only the
    observed condition is used and charged. `floor` ε is added to the variances, so that equal poses have a determinant.
    """

    def __init__(self, classifier, floor: float) -> None:
        super().__init__(classifier)
        self._floor = floor

    def describe(self, registrations: Registrations) -> Registrations:
        """Attach the residuals of both directions, unless they are attached already."""
        return measured(registrations, "residuals_", lambda: {"both_ways": residuals(registrations)})

    def features(self, registrations: Registrations) -> np.ndarray:
        """Return (N, 3): log forward and log backward residual (of diameters), log-determinant of covariance + floor.

        Raises:
            InputError: no covariance is attached, or it holds NaN.
        """
        from gpca.uncertainty.spread import log_determinant

        log_determinant_N = log_determinant(attached(registrations, "covariance")[:, OBSERVED], self._floor)
        return np.column_stack([self.describe(registrations).attached["residuals_both_ways"], log_determinant_N])

    def explain(self, registrations: Registrations) -> Attribution:
        """Score every registration by the classifier's probabilities, and charge the observed condition."""
        attribution = super().explain(registrations)
        seconds_N, icp_seconds_N, icp_calls_N = (
            attached(registrations, name)[:, OBSERVED] for name in ("seconds", "icp_seconds", "icp_calls")
        )
        return replace(
            attribution,
            seconds_N=attribution.seconds_N + seconds_N,
            icp_seconds_N=icp_seconds_N,
            icp_calls_N=icp_calls_N.astype(int),
        )


def residuals(registrations: Registrations) -> np.ndarray:
    """Return (N, 2): log forward and log backward residual of every registration, of diameters."""
    pairs = [(registrations.cloud(i), registrations.target(i)) for i in range(len(registrations))]
    return np.array([(log_residual(source, target), log_residual(target, source)) for source, target in pairs])


def log_residual(from_P_3: np.ndarray, to_Q_3: np.ndarray) -> float:
    """Return the log of the RMS distance from each point of one cloud to the nearest of the other."""
    from scipy.spatial import cKDTree

    from gpca.uncertainty.spread import log_residual as to_tree

    return to_tree(from_P_3, cKDTree(to_Q_3))


class ResidualRules(Residuals):
    """A shallow decision tree (CART, Breiman et al. 1984): rules that a person could have written (paper, Sec. II).

    Args:
        depth: maximum number of questions before an answer.
        smallest_leaf: minimum share of the training samples behind a rule.
    """

    def __init__(
        self,
        source: str,
        seed: int,
        depth: Annotated[int, Bounds(minimum=1, maximum=20)] = 3,
        smallest_leaf: Annotated[float, Bounds(exclusiveMinimum=0, maximum=0.5)] = 0.02,
        floor: Positive = FLOOR,
    ) -> None:
        from sklearn.tree import DecisionTreeClassifier

        random_state = seed_of(source, seed, "residual_rules") % 2**32
        self._tree = DecisionTreeClassifier(max_depth=depth, min_samples_leaf=smallest_leaf, random_state=random_state)
        super().__init__(self._tree, floor)

    def rules(self) -> list[str]:
        """Return a line for each leaf: its conditions, and the concept with its share."""
        tree = self._tree.tree_
        lines: list[str] = []

        def descend(node: int, conditions: list[str]) -> None:
            if tree.children_left[node] < 0:
                shares_C = tree.value[node, 0]
                best = int(shares_C.argmax())
                share = shares_C[best] / shares_C.sum()
                lines.append(f"{' and '.join(conditions) or 'always'}: {self._tree.classes_[best]} ({share:.0%})")
                return
            quantity, unit, power = QUANTITIES[tree.feature[node]]
            limit = f"{math.exp(tree.threshold[node] / power):.3g}{unit}"
            for child, sign in ((tree.children_left[node], "<="), (tree.children_right[node], ">")):
                descend(child, [*conditions, f"{quantity} {sign} {limit}"])

        descend(0, [])
        return lines


def residuals_logistic(
    source: str, seed: int, inverse_regularisation: Positive = 1.0, floor: Positive = FLOOR
) -> Residuals:
    return Residuals(standardized_regression(inverse_regularisation), floor)


def residuals_forest(source: str, seed: int, trees: Count = 200, floor: Positive = FLOOR) -> Residuals:
    from sklearn.ensemble import RandomForestClassifier

    random_state = seed_of(source, seed, "residuals_forest") % 2**32
    return Residuals(RandomForestClassifier(n_estimators=trees, random_state=random_state), floor)


_entry = partial(ExplainerEntry, sees=("pair", "runs"), reads="uncertainty/removal", observed_only=True)
EXPLAINERS = {
    "residuals_logistic": _entry("Residuals (logistic regression)", residuals_logistic),
    "residuals_forest": _entry("Residuals (random forest)", residuals_forest),
    "residuals_rules": _entry("Residuals (rules)", ResidualRules),
}
