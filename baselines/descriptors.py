"""Classifiers of causes on the descriptors of a pair (:mod:`gpca.features`): regressions on a few, trees on many.

``pair_forest`` reads what needs no further registration than the runs that tell the spread: 52 distances, ICP's motion,
fitness and spread. ``pair_boosting`` reads every descriptor.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gpca.causes.dataset import LABELS
from gpca.classifier.settings import LearningRate
from gpca.explainers.concept_classifier import ClassifierExplainer, standardized_regression
from gpca.explainers.interface import ExplainerEntry, attached
from gpca.features.settings import DENSITIES, GROUPS, RESIDUALS
from gpca.pairs.dataset import Registrations
from gpca.seeds import seed_of
from gpca.settings import Count, Positive


class DescriptorClassifier(ClassifierExplainer):
    """Scores are the probabilities of a scikit-learn classifier on some groups of descriptors.

    Args:
        classifier: an unfitted classifier with ``predict_proba``.
        groups: names in :data:`gpca.features.settings.GROUPS`.
        columns: of all of them together, those that it reads; None for all.
    """

    labels = LABELS

    def __init__(self, classifier, groups: Sequence[str], columns: Sequence[int] | None = None) -> None:
        super().__init__(classifier)
        self._groups = groups
        self._columns = columns

    def features(self, registrations: Registrations) -> np.ndarray:
        """Return the columns that the classifier reads."""
        joined_N_F = joined(registrations, self._groups)
        return joined_N_F if self._columns is None else joined_N_F[:, list(self._columns)]


def joined(registrations: Registrations, groups: Sequence[str]) -> np.ndarray:
    """Return these groups of descriptors, attached to the registrations, side by side (N, F)."""
    return np.hstack([attached(registrations, group) for group in groups])


def residuals(source: str, seed: int, inverse_regularisation: Positive = 1.0) -> DescriptorClassifier:
    """Make the rival that reads residuals at several scales, in both directions, and the spread.

    Quantiles of the distances are residuals of trimmed pairs, so they stand apart from how much of the clouds overlaps.
    """
    regression = standardized_regression(inverse_regularisation)
    return DescriptorClassifier(regression, ("distances", "motion"), RESIDUALS)


def density(source: str, seed: int, inverse_regularisation: Positive = 1.0) -> DescriptorClassifier:
    """Make the control that reads spacings and numbers of points: the shortcut that a fixed draw of points opens."""
    return DescriptorClassifier(standardized_regression(inverse_regularisation), ("planes",), DENSITIES)


def entropies(source: str, seed: int, inverse_regularisation: Positive = 1.0) -> DescriptorClassifier:
    """Make the rival that reads the entropies of the clouds, joint and apart (CorAl, Adolfsson et al. 2021)."""
    return DescriptorClassifier(standardized_regression(inverse_regularisation), ("entropy",))


def randomized_trees(source: str, seed: int, trees: int = 300, smallest_leaf: int = 2):
    """Return an unfitted forest of extremely randomized trees (Geurts et al. 2006)."""
    from sklearn.ensemble import ExtraTreesClassifier

    return ExtraTreesClassifier(
        trees,
        min_samples_leaf=smallest_leaf,
        max_features=0.3,
        random_state=seed_of(source, seed, "randomised trees") % 2**32,
    )


def boosted_trees(source: str, seed: int, iterations: int = 150, learning_rate: float = 0.06):
    """Return unfitted gradient boosting on histograms (Ke et al. 2017)."""
    from sklearn.ensemble import HistGradientBoostingClassifier

    return HistGradientBoostingClassifier(
        learning_rate=learning_rate,
        max_iter=iterations,
        min_samples_leaf=8,
        l2_regularization=1.0,
        max_features=0.3,
        early_stopping=False,
        random_state=seed_of(source, seed, "boosted trees") % 2**32,
    )


def pair_forest(source: str, seed: int, trees: Count = 300, smallest_leaf: Count = 2) -> DescriptorClassifier:
    """Make the forest."""
    return DescriptorClassifier(randomized_trees(source, seed, trees, smallest_leaf), ("distances", "motion"))


def pair_boosting(
    source: str, seed: int, iterations: Count = 150, learning_rate: LearningRate = 0.06
) -> DescriptorClassifier:
    """Make the boosted trees."""
    return DescriptorClassifier(boosted_trees(source, seed, iterations, learning_rate), GROUPS)


CAUSE_EXPLAINERS = {
    "residuals": ExplainerEntry("Residuals (regression)", residuals, reads="descriptors"),
    "density": ExplainerEntry("Density alone (control)", density, reads="descriptors"),
    "entropies": ExplainerEntry("Entropies, CorAl (regression)", entropies, reads="descriptors"),
    "pair_forest": ExplainerEntry("Distances of the pair (forest)", pair_forest, reads="descriptors"),
    "pair_boosting": ExplainerEntry("All descriptors (boosting)", pair_boosting, reads="descriptors"),
}
