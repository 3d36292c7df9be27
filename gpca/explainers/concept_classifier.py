"""Scikit-learn classifiers of concepts, for the rivals that learn from a few numbers per registration."""

from __future__ import annotations

import numpy as np

from gpca.errors import InputError
from gpca.explainers.interface import ScoringExplainer
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS

PAPERS_RANDOM_STATE = 42  # of the forest and of the linear SVM in Table V


class ConceptClassifier:
    """A classifier whose score columns are always the same labels, whichever of them its training rows hold.

    Args:
        classifier: an unfitted scikit-learn classifier or pipeline with ``predict_proba``.
        labels: (C,) those of the columns.
    """

    def __init__(self, classifier, labels: tuple[str, ...] = CONCEPTS) -> None:
        self._classifier = classifier
        self._labels = labels

    def fit(self, features_N_F: np.ndarray, concept_N: np.ndarray) -> ConceptClassifier:
        """Learn from labeled features; fewer than two concepts among the labels raise an InputError."""
        known_concepts(concept_N, self._labels)
        self._classifier.fit(features_N_F, concept_N)
        return self

    def scores(self, features_N_F: np.ndarray) -> np.ndarray:
        """Return probabilities (N, C) in the order of the labels; one absent from training has 0."""
        scores_N_C = np.zeros((len(features_N_F), len(self._labels)))
        columns = [self._labels.index(concept) for concept in self._classifier.classes_]
        scores_N_C[:, columns] = self._classifier.predict_proba(features_N_F)
        return scores_N_C


class ClassifierExplainer(ScoringExplainer):
    """Scores are the probabilities of a scikit-learn classifier, unfitted when it is given, on some features."""

    def __init__(self, classifier) -> None:
        self._classifier = ConceptClassifier(classifier, self.labels)

    def fit(self, registrations: Registrations) -> None:
        """Fit the classifier to the labeled registrations."""
        self._classifier.fit(self.features(registrations), registrations.concept)

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Return the classifier's probabilities."""
        return self._classifier.scores(self.features(registrations))

    def features(self, registrations: Registrations) -> np.ndarray:
        """Return the features (N, F) that the classifier reads."""
        raise NotImplementedError


def known_concepts(concept_N: np.ndarray, labels: tuple[str, ...] = CONCEPTS) -> list[str]:
    """Return the labels among those of training samples, in their order; fewer than two raise an InputError."""
    known = [label for label in labels if (concept_N == label).any()]
    if len(known) < 2:
        raise InputError("training registrations", "cover fewer than two concepts", "give samples of at least two")
    return known


def standardized_regression(inverse_regularisation: float):
    """Return an unfitted multinomial logistic regression on standardized features (L2, scikit-learn's C)."""
    from sklearn.linear_model import LogisticRegression
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    return make_pipeline(StandardScaler(), LogisticRegression(C=inverse_regularisation, max_iter=1000))
