"""Explainers that see the pair, both clouds and the motion of ICP or without it, and not the aligned source alone.

`gpca_pair` is the paper's classifier with other eyes: a row of its own, never "GP-CA (paper)". What it reads does not
depend on which object is registered (:func:`gpca.pairs.description.relations`). `gpca_pair_clouds` is the same
without how far ICP moved the cloud, which gives pose errors away where nothing else starts off. Beside them stand the
plainest form of the same idea, a forest on distances, and a rival that knows only the density of the cloud.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from gpca.causes.settings import DescribedPoints
from gpca.classifier.settings import GPCArguments
from gpca.explainers.concept_classifier import ClassifierExplainer, standardized_regression
from gpca.explainers.gpca import DescriptorGPCA
from gpca.explainers.interface import ExplainerEntry, measured
from gpca.explainers.sight import Sees
from gpca.pairs.dataset import Registrations
from gpca.seeds import seed_of
from gpca.settings import Count, Positive

CLOUDS: Sees = ("pair",)
WITH_MOTION: Sees = ("pair", "motion")
WITHOUT = "without ICP's motion"  # in titles


class PairDescription:
    """The base of these explainers: each reads one group of descriptors of every pair.

    Args:
        source, seed: name the draws from the clouds.
        group: one of :data:`gpca.pairs.description.WIDTHS`.
        points: drawn from each cloud.
        motion: whether the relations tell how far ICP moved the cloud.
    """

    def __init__(self, source: str, seed: int, group: str, points: int, motion: bool = True) -> None:
        self._axes = (source, seed)
        self._group = group
        self._motion = motion
        self._points = points
        self._prefix = f"pair_{source}_{seed}_{points}_"

    def describe(self, registrations: Registrations) -> Registrations:
        """Attach the descriptors, unless they are attached already."""
        from gpca.pairs.description import describe_registrations

        return measured(
            registrations,
            self._prefix,
            lambda: describe_registrations(registrations, *self._axes, points=self._points),
        )

    def features(self, registrations: Registrations) -> np.ndarray:
        """Return the group (N, F)."""
        from gpca.pairs.description import MOVED

        features_N_F = self.describe(registrations).attached[self._prefix + self._group]
        return features_N_F if self._motion else np.delete(features_N_F, MOVED, axis=1)


class PairGPCA(PairDescription, DescriptorGPCA):
    """GP-CA on the relations of the pair.

    Args:
        motion: whether they tell how far ICP moved the cloud.
        source, seed: name the draws.
        points: drawn from each cloud.
        settings: those of the GPC, as for GP-CA.
    """

    def __init__(
        self, motion: bool, source: str, seed: int, points: DescribedPoints = 512, **settings: GPCArguments
    ) -> None:
        PairDescription.__init__(self, source, seed, "relations", points, motion)
        DescriptorGPCA.__init__(self, (source, seed, "gpca_pair"), source, seed, **settings)


class PairLearner(PairDescription, ClassifierExplainer):
    """Scores are the probabilities of a scikit-learn classifier on one group."""

    def __init__(self, classifier, *description) -> None:
        PairDescription.__init__(self, *description)
        ClassifierExplainer.__init__(self, classifier)


def pair_forest(source: str, seed: int, trees: Count = 200, points: DescribedPoints = 512) -> PairLearner:
    """Make a random forest on the 52 distances of the pair."""
    from sklearn.ensemble import RandomForestClassifier

    random_state = seed_of(source, seed, "pair_forest") % 2**32
    return PairLearner(
        RandomForestClassifier(n_estimators=trees, random_state=random_state), source, seed, "distances", points
    )


def density(
    source: str, seed: int, inverse_regularisation: Positive = 1.0, points: DescribedPoints = 512
) -> PairLearner:
    """Make the logistic regression that knows spacing and extent of the observed cloud, and nothing else."""
    return PairLearner(standardized_regression(inverse_regularisation), source, seed, "densities", points)


EXPLAINERS = {
    "gpca_pair": ExplainerEntry("GP-CA on the pair", partial(PairGPCA, True), WITH_MOTION),
    "gpca_pair_clouds": ExplainerEntry(f"GP-CA on the pair, {WITHOUT}", partial(PairGPCA, False), CLOUDS),
    "pair_forest": ExplainerEntry("Distances of the pair (random forest)", pair_forest, CLOUDS),
    "density": ExplainerEntry("Density alone (logistic regression)", density, CLOUDS),
}
