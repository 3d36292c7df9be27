"""Ensembles of trees on the descriptors of a pair.

``pair_forest`` reads what needs no further registration than the runs that tell the spread: 52 distances, ICP's motion,
fitness and spread. ``pair_boosting`` reads every descriptor.
"""

from __future__ import annotations

from baselines.causes.described import DescriptorClassifier
from gpca.classifier.settings import LearningRate
from gpca.explainers.interface import ExplainerEntry
from gpca.features.groups import GROUPS
from gpca.seeds import seed_of
from gpca.settings import Count


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


EXPLAINERS = {
    "pair_forest": ExplainerEntry("Distances of the pair (forest)", pair_forest, reads="descriptors"),
    "pair_boosting": ExplainerEntry("All descriptors (boosting)", pair_boosting, reads="descriptors"),
}
