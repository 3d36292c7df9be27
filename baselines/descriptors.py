"""Explainers of causes on the descriptors of a pair (:mod:`gpca.causes.descriptors`): regressions, trees, GP-CA.

``pair_forest`` reads 52 distances, ICP's motion, fitness and spread; ``pair_boosting`` reads every descriptor.
``gpca_pair`` is GP-CA's multi-class classifier. ``gpca_multilabel`` has a Gaussian process for failure and one for each
cause, so that several causes may have high scores. ``pair_committee`` averages a forest, boosting and GP-CA. Names that
end in ``_clouds`` see the two clouds after ICP alone. ``trees_on_*`` and ``gpca_on_*`` measure what each part is worth,
in the order of cost; runs from other starts and remedies without restarts cost the same with the default settings.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from gpca.causes.dataset import LABELS
from gpca.causes.descriptors import EVERY, EVERYTHING, RESIDUALS, Columns, seen
from gpca.causes.settings import DENSITIES
from gpca.causes.truth import NOMINAL
from gpca.classifier.settings import GPCArguments, LearningRate
from gpca.explainers.classifiers import boosted_trees, known_concepts, standardized_regression
from gpca.explainers.gpca import DescriptorGPCA
from gpca.explainers.interface import (
    ClassifierExplainer,
    ConceptExplainer,
    ExplainerEntry,
    ScoringExplainer,
    Sees,
    attached,
    in_words,
)
from gpca.pairs.dataset import Registrations
from gpca.seeds import seed_of
from gpca.settings import Count, Positive

CLOUDS: Sees = ("pair",)
WITH_RUNS: Sees = ("pair", "motion", "runs")
ALL: Sees = (*WITH_RUNS, "remedies")
WITHOUT = "clouds alone"  # in titles: no motion of ICP, no further runs, no remedies


def described(registrations: Registrations, sees: Sees, wanted: Columns = EVERYTHING) -> np.ndarray:
    """Return the attached descriptors (:func:`gpca.causes.descriptors.seen`)."""
    return seen({group: attached(registrations, group) for group in wanted}, sees, wanted)


class DescriptorClassifier(ClassifierExplainer):
    """Probabilities of an unfitted scikit-learn classifier on the `wanted` columns of the parts it sees."""

    labels = LABELS

    def __init__(self, classifier, sees: Sees, wanted: Columns = EVERYTHING) -> None:
        super().__init__(classifier)
        self._sees, self._wanted = sees, wanted

    def features(self, registrations: Registrations) -> np.ndarray:
        """Return the columns."""
        return described(registrations, self._sees, self._wanted)


def residuals(sees: Sees, source: str, seed: int, inverse_regularisation: Positive = 1.0) -> DescriptorClassifier:
    """Make a regression on residuals at several scales, in both directions, and the spread.

    Quantiles of the distances are residuals of trimmed pairs, so they do not depend on the overlap.
    """
    return DescriptorClassifier(standardized_regression(inverse_regularisation), sees, RESIDUALS)


def density(sees: Sees, source: str, seed: int, inverse_regularisation: Positive = 1.0) -> DescriptorClassifier:
    """Make the control that reads spacings and numbers of points: the shortcut that a fixed draw of points opens."""
    return DescriptorClassifier(standardized_regression(inverse_regularisation), sees, {"planes": DENSITIES})


def entropies(sees: Sees, source: str, seed: int, inverse_regularisation: Positive = 1.0) -> DescriptorClassifier:
    """Make a regression on the entropies of the clouds, joint and apart (CorAl, Adolfsson et al. 2021)."""
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
    wanted = {"distances": EVERY, "motion": EVERY}
    return DescriptorClassifier(randomized_trees(source, seed, trees, smallest_leaf), sees, wanted)


def forest_of_all(
    sees: Sees, source: str, seed: int, trees: Count = 300, smallest_leaf: Count = 2
) -> DescriptorClassifier:
    return DescriptorClassifier(randomized_trees(source, seed, trees, smallest_leaf), sees)


def pair_boosting(
    sees: Sees, source: str, seed: int, iterations: Count = 150, learning_rate: LearningRate = 0.06
) -> DescriptorClassifier:
    classifier = boosted_trees(source, seed, iterations=iterations, learning_rate=learning_rate)
    return DescriptorClassifier(classifier, sees)


class CausePairGPCA(DescriptorGPCA):
    """GP-CA on the descriptors of the parts that it sees."""

    labels = LABELS

    def __init__(self, sees: Sees, source: str, seed: int, **settings: GPCArguments) -> None:
        super().__init__((source, seed, "causes"), source, seed, **settings)
        self._sees = sees

    def features(self, registrations: Registrations) -> np.ndarray:
        """Return the descriptors."""
        return described(registrations, self._sees)


class MultiLabelGPCA(ScoringExplainer):
    """Binary GPs for failure and for each cause; a cause's score is its probability times that of a failure."""

    labels = LABELS

    def __init__(self, sees: Sees, source: str, seed: int, **settings: GPCArguments) -> None:
        from gpca.classifier.settings import GPCSettings
        from gpca.explainers.pair_classifier import PairClassifier

        self._sees = sees
        self._classifier = PairClassifier(GPCSettings(**settings), source, seed, "causes")

    def fit(self, registrations: Registrations) -> None:
        """Fit the four classifiers to the labels and the sets of causes, which are attached as ``causes``."""
        known_concepts(registrations.concept, LABELS)
        causes_N_3 = attached(registrations, "causes") > 0.5
        self._classifier.fit(described(registrations, self._sees), registrations.concept != NOMINAL, causes_N_3)

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Return the probabilities of no failure, and of each cause with a failure."""
        judged = self._classifier.judge(self._classifier.normalized(described(registrations, self._sees)))
        return np.column_stack([1 - judged.failure_N, judged.failure_N[:, None] * judged.causes_N_3])


class Committee(ScoringExplainer):
    """The mean of three explainers of different kinds, whose errors differ."""

    labels = LABELS

    def __init__(self, sees: Sees, source: str, seed: int) -> None:
        self._members: list[ConceptExplainer] = [
            DescriptorClassifier(randomized_trees(source, seed), sees),
            DescriptorClassifier(boosted_trees(source, seed), sees),
            CausePairGPCA(sees, source, seed, learning_rate=0.1, iterations=200),
        ]

    def fit(self, registrations: Registrations) -> None:
        """Fit every member."""
        for member in self._members:
            member.fit(registrations)

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Return the mean of the members' scores."""
        return np.mean([member.explain(registrations).scores_N_C for member in self._members], axis=0)


def entry(title: str, make: Callable[..., ConceptExplainer], sees: Sees) -> ExplainerEntry:
    """Return the entry of an explainer whose first argument is what it sees."""
    return ExplainerEntry(title, partial(make, sees), sees, reads="descriptors")


LEVELS: dict[str, Sees] = {
    "source": ("source",),
    "pair": CLOUDS,
    "motion": ("pair", "motion"),
    "runs": WITH_RUNS,
    "quick_remedies": ("pair", "motion", "quick_remedies"),
    "everything": ALL,
}
CAUSE_EXPLAINERS = {
    "residuals": entry("Residuals (regression)", residuals, WITH_RUNS),
    "residuals_clouds": entry(f"Residuals (regression), {WITHOUT}", residuals, CLOUDS),
    "density": entry("Density alone (control)", density, CLOUDS),
    "entropies": entry("Entropies, CorAl (regression)", entropies, CLOUDS),
    "pair_forest": entry("Distances of the pair (forest)", pair_forest, WITH_RUNS),
    "pair_forest_clouds": entry(f"Distances of the pair (forest), {WITHOUT}", pair_forest, CLOUDS),
    "pair_boosting": entry("All descriptors (boosting)", pair_boosting, ALL),
    "pair_boosting_clouds": entry(f"Descriptors (boosting), {WITHOUT}", pair_boosting, CLOUDS),
    "gpca_pair": entry("GP-CA on the pair", CausePairGPCA, ALL),
    "gpca_pair_clouds": entry(f"GP-CA on the pair, {WITHOUT}", CausePairGPCA, CLOUDS),
    "gpca_multilabel": entry("GP-CA on the pair, multi-label", MultiLabelGPCA, ALL),
    "gpca_multilabel_clouds": entry(f"GP-CA on the pair, multi-label, {WITHOUT}", MultiLabelGPCA, CLOUDS),
    "pair_committee": entry("Committee on the pair", Committee, ALL),
    "pair_committee_clouds": entry(f"Committee on the pair, {WITHOUT}", Committee, CLOUDS),
    **{f"trees_on_{name}": entry(f"Forest on {in_words(sees)}", forest_of_all, sees) for name, sees in LEVELS.items()},
    **{
        f"gpca_on_{name}": entry(f"GP-CA's classifier on {in_words(sees)}", CausePairGPCA, sees)
        for name, sees in LEVELS.items()
    },
}
