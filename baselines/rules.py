"""Rules that a person can read: a shallow decision tree on the three numbers of the residuals.

The paper says that rule-based systems and decision trees need no explanation (Sec. II). This is the floor: an
explainer that does no better than a few thresholds has found nothing that a person could not have written down.
"""

from __future__ import annotations

import math
from typing import Annotated

from baselines.residuals import FLOOR, Residuals
from gpca.explainers.interface import ExplainerEntry
from gpca.seeds import seed_of
from gpca.settings import Bounds, Positive

# How a person reads the three features: name, unit, and how often the logarithm counts the quantity. The sixth root of
# a covariance's determinant is a variance, and the root of this a deviation.
QUANTITIES = (
    ("distance from source to target", " d", 1),
    ("distance from target to source", " d", 1),
    ("deviation of the poses", "", 12),
)


class ResidualRules(Residuals):
    """A decision tree (CART, Breiman et al. 1984) on log forward and backward residual and the log-determinant.

    Args:
        depth: questions on the way to an answer, at most; eight rules at three.
        smallest_leaf: share of the training samples that a rule stands for, at least.
        floor: see :class:`baselines.residuals.Residuals`.
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
        """Return a line for each leaf: the conditions on the way there, and the concept with its share."""
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


EXPLAINERS = {
    "residuals_rules": ExplainerEntry(
        "Residuals (rules)", ResidualRules, ("pair", "runs"), reads="uncertainty/removal", observed_only=True
    )
}
