"""The learners of the curve: trees, which gain from every sample, and GP-CA's classifier."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gpca.causes.dataset import LABELS
from gpca.classifier.settings import GPCSettings
from gpca.experiments.learning_curve.samples import Lessons
from gpca.seeds import seed_of

TITLES = {"trees": "Extremely randomized trees", "gpca": "GP-CA's classifier"}
TREES = 300
Scores = Callable[[Lessons], np.ndarray]  # (N, 4) of the labels


def learn(name: str, lessons: Lessons, classifier: GPCSettings, source: str, seed: int, *axes: object) -> Scores:
    """Return what a learner of :data:`TITLES` has learned; the axes name its draws."""
    return {"trees": _trees, "gpca": _gpca}[name](lessons, classifier, source, seed, *axes)


def _trees(lessons: Lessons, _classifier: GPCSettings, source: str, seed: int, *axes: object) -> Scores:
    """Fit extremely randomized trees (Geurts et al. 2006), as the explainers on descriptors are."""
    from sklearn.ensemble import ExtraTreesClassifier

    from gpca.explainers.classifiers import ConceptClassifier

    state = seed_of(source, seed, "learning curve", *axes) % 2**32
    forest = ExtraTreesClassifier(TREES, min_samples_leaf=2, max_features=0.3, random_state=state)
    fitted = ConceptClassifier(forest, LABELS).fit(lessons.features, lessons.label)
    return lambda of: fitted.scores(of.features)


def _gpca(lessons: Lessons, classifier: GPCSettings, source: str, seed: int, *axes: object) -> Scores:
    """Fit the Gaussian process classifier to ranks of the descriptors, as ``gpca_pair`` does."""
    from gpca.classifier.gpc import GPC
    from gpca.explainers.pair_classifier import NormalizedFeatures

    normalized = NormalizedFeatures(source, seed, "learning curve", *axes)
    normalized.fit(lessons.features)
    gpc = GPC(LABELS, classifier, source, seed)
    gpc.fit(normalized(lessons.features), lessons.label)
    return lambda of: gpc.attribute(normalized(of.features))[0]
