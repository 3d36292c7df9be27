"""Explainers of causes that learn from the descriptors of a pair (:mod:`gpca.descriptors`) with any classifier."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import perf_counter

import numpy as np

from baselines.attached import attached
from baselines.concept_classifier import ConceptClassifier
from gpca.attribution.scores import Attribution
from gpca.causes.labels import LABELS
from gpca.pairs.dataset import Registrations


class DescribedPairs:
    """Scores are the probabilities of a scikit-learn classifier on some groups of descriptors.

    Args:
        classifier: an unfitted classifier with ``predict_proba``.
        groups: names in :data:`gpca.descriptors.groups.GROUPS`.
        columns: of all of them together, those that it reads; None for all.
    """

    def __init__(self, classifier, groups: Sequence[str], columns: Sequence[int] | None = None) -> None:
        self._classifier = ConceptClassifier(classifier, LABELS)
        self._features = described(groups, columns)

    def fit(self, registrations: Registrations) -> None:
        """Learn from labelled registrations."""
        self._classifier.fit(self._features(registrations), registrations.concept)

    def explain(self, registrations: Registrations) -> Attribution:
        """Score every registration by the classifier's probabilities."""
        started = perf_counter()
        scores_N_C = self._classifier.scores(self._features(registrations))
        return Attribution.of_scores(LABELS, scores_N_C, seconds=(perf_counter() - started) / len(registrations))


def described(groups: Sequence[str], columns: Sequence[int] | None = None) -> Callable[[Registrations], np.ndarray]:
    """Return the function that joins these groups, (S, F), of registrations that they are attached to."""

    def features(registrations: Registrations) -> np.ndarray:
        joined_S_F = np.hstack([attached(registrations, group, None) for group in groups])
        return joined_S_F if columns is None else joined_S_F[:, list(columns)]

    return features
