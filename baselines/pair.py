"""Explainers that see the pair, both clouds and perhaps the motion of ICP, instead of the aligned source alone."""

from functools import partial

import numpy as np

from gpca.causes.settings import DescribedPoints
from gpca.classifier.settings import GPCArguments
from gpca.explainers.classifiers import standardized_regression
from gpca.explainers.gpca import DescriptorGPCA
from gpca.explainers.interface import ClassifierExplainer, ExplainerEntry, Sees, measured
from gpca.pairs.dataset import Registrations
from gpca.seeds import seed_of
from gpca.settings import Count, Positive

CLOUDS: Sees = ("pair",)
WITH_MOTION: Sees = ("pair", "motion")
WITH_RUNS: Sees = ("pair", "motion", "runs")
WITHOUT = "without ICP's motion"  # in titles


class PairDescription:
    """Base of these explainers: each reads one group of :data:`gpca.pairs.distances.WIDTHS` of every pair."""

    def __init__(self, source: str, seed: int, group: str, points: int, motion: bool = True) -> None:
        self._axes, self._group, self._motion, self._points = (source, seed), group, motion, points
        self._prefix = f"pair_{source}_{seed}_{points}_"

    def describe(self, registrations: Registrations) -> Registrations:
        from gpca.pairs.distances import describe_registrations

        describe = partial(describe_registrations, registrations, *self._axes, points=self._points)
        return measured(registrations, self._prefix, describe)

    def features(self, registrations: Registrations) -> np.ndarray:
        from gpca.pairs.distances import MOVED

        features_N_F = self.describe(registrations).attached[self._prefix + self._group]
        return features_N_F if self._motion else np.delete(features_N_F, MOVED, axis=1)


class PairGPCA(PairDescription, DescriptorGPCA):
    """GP-CA on the relations of the pair, with or without the motion of ICP."""

    def __init__(
        self, motion: bool, source: str, seed: int, points: DescribedPoints = 512, **settings: GPCArguments
    ) -> None:
        PairDescription.__init__(self, source, seed, "relations", points, motion)
        DescriptorGPCA.__init__(self, (source, seed, "gpca_pair"), source, seed, **settings)


class PairModel(PairDescription, ClassifierExplainer):
    """Scores are the probabilities of a scikit-learn classifier on one group."""

    def __init__(self, classifier, *description) -> None:
        PairDescription.__init__(self, *description)
        ClassifierExplainer.__init__(self, classifier)


def pair_forest(source: str, seed: int, trees: Count = 200, points: DescribedPoints = 512) -> PairModel:
    """Make a forest on the 52 distances of the pair."""
    from sklearn.ensemble import RandomForestClassifier

    random_state = seed_of(source, seed, "pair_forest") % 2**32
    classifier = RandomForestClassifier(n_estimators=trees, random_state=random_state)
    return PairModel(classifier, source, seed, "distances", points)


def density(source: str, seed: int, inverse_regularisation: Positive = 1.0, points: DescribedPoints = 512) -> PairModel:
    """Make a logistic regression on spacing and extent of the observed cloud."""
    return PairModel(standardized_regression(inverse_regularisation), source, seed, "densities", points)


EXPLAINERS = {
    "gpca_pair": ExplainerEntry("GP-CA on the pair", partial(PairGPCA, True), WITH_MOTION),
    "gpca_pair_clouds": ExplainerEntry(f"GP-CA on the pair, {WITHOUT}", partial(PairGPCA, False), CLOUDS),
    "pair_forest": ExplainerEntry("Distances of the pair (random forest)", pair_forest, CLOUDS),
    "density": ExplainerEntry("Density alone (logistic regression)", density, CLOUDS),
}
