"""Classifiers of causes on descriptors of a pair (:mod:`gpca.causes.descriptors`): regressions or trees.

``pair_forest`` reads what needs no further registration than the runs that tell the spread: 52 distances, ICP's motion,
fitness and spread. ``pair_boosting`` reads every descriptor. Names that end in ``_clouds`` see the two clouds alone,
where ICP put them, and not how it moved them there.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from gpca.causes.dataset import LABELS
from gpca.causes.descriptors import EVERY, EVERYTHING, RESIDUALS, Columns, seen
from gpca.causes.settings import DENSITIES
from gpca.classifier.settings import LearningRate
from gpca.explainers.boosted_trees import boosted_trees
from gpca.explainers.concept_classifier import ClassifierExplainer, standardized_regression
from gpca.explainers.interface import ConceptExplainer, ExplainerEntry, attached
from gpca.explainers.sight import Sees
from gpca.pairs.dataset import Registrations
from gpca.seeds import seed_of
from gpca.settings import Count, Positive

CLOUDS: Sees = ("pair",)
WITH_RUNS: Sees = ("pair", "motion", "runs")
ALL: Sees = (*WITH_RUNS, "remedies")
WITHOUT = "clouds alone"  # in titles: no motion of ICP, no further runs, no remedies


class DescriptorClassifier(ClassifierExplainer):
    """Scores are the probabilities of a scikit-learn classifier on some descriptors.

    Args:
        classifier: an unfitted classifier with ``predict_proba``.
        sees: the parts that it reads descriptors of.
        wanted: of these, its columns.
    """

    labels = LABELS

    def __init__(self, classifier, sees: Sees, wanted: Columns = EVERYTHING) -> None:
        super().__init__(classifier)
        self._sees = sees
        self._wanted = wanted

    def features(self, registrations: Registrations) -> np.ndarray:
        """Return the columns that the classifier reads."""
        return described(registrations, self._sees, self._wanted)


def described(registrations: Registrations, sees: Sees, wanted: Columns = EVERYTHING) -> np.ndarray:
    """Return the descriptors that are attached to the registrations, see :func:`gpca.causes.descriptors.seen`."""
    return seen({group: attached(registrations, group) for group in wanted}, sees, wanted)


def residuals(sees: Sees, source: str, seed: int, inverse_regularisation: Positive = 1.0) -> DescriptorClassifier:
    """Make the rival that reads residuals at several scales, in both directions, and the spread.

    Quantiles of the distances are residuals of trimmed pairs, so they stand apart from how much of the clouds overlaps.
    """
    return DescriptorClassifier(standardized_regression(inverse_regularisation), sees, RESIDUALS)


def density(sees: Sees, source: str, seed: int, inverse_regularisation: Positive = 1.0) -> DescriptorClassifier:
    """Make the control that reads spacings and numbers of points: the shortcut that a fixed draw of points opens."""
    return DescriptorClassifier(standardized_regression(inverse_regularisation), sees, {"planes": DENSITIES})


def entropies(sees: Sees, source: str, seed: int, inverse_regularisation: Positive = 1.0) -> DescriptorClassifier:
    """Make the rival that reads the entropies of the clouds, joint and apart (CorAl, Adolfsson et al. 2021)."""
    return DescriptorClassifier(standardized_regression(inverse_regularisation), sees, {"entropy": EVERY})


def randomized_trees(source: str, seed: int, trees: int = 300, smallest_leaf: int = 2):
    """Return an unfitted forest of extremely randomized trees (Geurts et al. 2006)."""
    from sklearn.ensemble import ExtraTreesClassifier

    return ExtraTreesClassifier(
        trees,
        min_samples_leaf=smallest_leaf,
        max_features=0.3,
        random_state=seed_of(source, seed, "randomised trees") % 2**32,
    )


def pair_forest(
    sees: Sees, source: str, seed: int, trees: Count = 300, smallest_leaf: Count = 2
) -> DescriptorClassifier:
    """Make the forest."""
    wanted = {"distances": EVERY, "motion": EVERY}
    return DescriptorClassifier(randomized_trees(source, seed, trees, smallest_leaf), sees, wanted)


def pair_boosting(
    sees: Sees, source: str, seed: int, iterations: Count = 150, learning_rate: LearningRate = 0.06
) -> DescriptorClassifier:
    """Make the boosted trees."""
    classifier = boosted_trees(source, seed, iterations=iterations, learning_rate=learning_rate)
    return DescriptorClassifier(classifier, sees)


def entry(title: str, make: Callable[..., ConceptExplainer], sees: Sees) -> ExplainerEntry:
    """Return the entry of an explainer that is made with what it sees."""
    return ExplainerEntry(title, partial(make, sees), sees, reads="descriptors")


CAUSE_EXPLAINERS = {
    "residuals": entry("Residuals (regression)", residuals, WITH_RUNS),
    "residuals_clouds": entry(f"Residuals (regression), {WITHOUT}", residuals, CLOUDS),
    "density": entry("Density alone (control)", density, CLOUDS),
    "entropies": entry("Entropies, CorAl (regression)", entropies, CLOUDS),
    "pair_forest": entry("Distances of the pair (forest)", pair_forest, WITH_RUNS),
    "pair_forest_clouds": entry(f"Distances of the pair (forest), {WITHOUT}", pair_forest, CLOUDS),
    "pair_boosting": entry("All descriptors (boosting)", pair_boosting, ALL),
    "pair_boosting_clouds": entry(f"Descriptors (boosting), {WITHOUT}", pair_boosting, CLOUDS),
}
